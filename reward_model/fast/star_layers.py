"""The star network in compiled code: from packed frames to scores in one pass, for all members.

The arithmetic is that of `reward_model.networks.star`, with the batch normalisations folded into the matrices and all
widths filled up with zeros to multiples of `LANES`. All hidden rows stand in one work array, whose parts are named by
their first place: making arrays would take longer than the products of a single window. Rows of the mirror images
follow those of the scenes.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from reward_model.base.arrays import Float32Array, FloatArray, IntArray
from reward_model.base.numba import njit
from reward_model.fast.elu import apply_exp
from reward_model.fast.matmul import LANES, add_flat_product, put_flat_product
from reward_model.graph.facts import SPEED_UNIT, TURN_UNIT
from reward_model.graph.packing import Stack
from reward_model.graph.star_kernels import OBJECT_EVEN, PAIR_EVEN, PERSON_EVEN, ROOM_EVEN, WALL_EVEN, Rows, star_rows

# The places of a member's matrices. Of every kind of rows: the first layer's bias, its matrices for even and odd
# columns and for the room's, the second layer's bias and matrix.
BIAS, EVEN, ODD, ROOM_BY_EVEN, ROOM_BY_ODD, SECOND_BIAS, SECOND = range(7)
PER_KIND: Final = 7
# Then the room's own matrices; and for every round those of the room, of attention and of the rows, by kind.
OWN_EVEN, OWN_ODD, LAST_BIAS, LAST, SCORES_BIAS, SCORES = range(4 * PER_KIND, 4 * PER_KIND + 6)
FIRST_ROUND: Final = 4 * PER_KIND + 6
ROUND_BIAS, ROUND_ROOM, ROUND_POOLED, ATTENTION, ATTENTION_BIAS = 0, 1, 2, 6, 10
ROW_BIAS, ROW_CONTEXT, ROW = 14, 18, 22
PER_ROUND: Final = 26

_NUM_KINDS: Final = 4
_ZERO, _ANY = np.float32(0.0), np.float32(-np.inf)  # the least numbers with ReLU and without
_MANY_ROWS: Final = 100  # of a window and kind
_ROOMS: Final = 4  # the place of rooms among the kinds of inputs
_EVEN_COLUMNS = np.array([PERSON_EVEN, OBJECT_EVEN, WALL_EVEN, PAIR_EVEN, ROOM_EVEN])


class StarArrays(NamedTuple):
    """A star network's arrays.

    Attributes:
        weights: all matrices, one after the other
        matrices: (num_members, num_matrices, 3) the start of each, its rows and columns
        inputs: (4 + 1, 2, 47) means and inverse deviations of the columns of people, objects, walls, pairs and rooms
        num_rounds: of aggregation
        widest, widest_row: the largest number of columns of a matrix, and of one that rows are multiplied with
        contact: (3,) [m] distances at which the robot touches a person, an object and a wall
        limits: `LIMIT`, `SUM_SCALE`, `MOST_ATTENTION`, `LEAST_TOTAL` and `CONTACT_SCORE` of the definition
        facts: (2, 6) the least and the largest of each fact in the training data; infinite where they are not known
    """

    weights: Float32Array
    matrices: IntArray
    inputs: Float32Array
    num_rounds: int
    widest: int
    widest_row: int
    contact: Float32Array
    limits: Float32Array
    facts: FloatArray


class _Batch(NamedTuple):
    """The inputs of several windows.

    Attributes:
        inputs: standardised rows, of all kinds and of rooms
        starts: (5,) where each of them begins
        columns: (5,) their columns
        counts, firsts: (num_windows, 4) rows of each kind, and the first of them
        totals: (4,) rows of each kind
        scale: (num_windows,) of sums
    """

    inputs: Float32Array
    starts: IntArray
    columns: IntArray
    counts: IntArray
    firsts: IntArray
    totals: IntArray
    scale: Float32Array


class _Places(NamedTuple):
    """Where the parts of the work array begin.

    Attributes:
        hidden: (4,) of the rows of each kind, of both images
        spare: (4,) of as many rows, for the next round
        even, odd: of the two parts of a first layer
        both: of a layer's rows of both images
        room, next_room: (2 num_windows, ...) of the rooms' rows
        by_window, by_window_odd: of what the rooms give to rows
        pooled, logits, factors: of aggregation
    """

    hidden: IntArray
    spare: IntArray
    even: int
    odd: int
    both: int
    room: int
    next_room: int
    by_window: int
    by_window_odd: int
    pooled: int
    logits: int
    factors: int


@njit
def score_stars(stack: Stack, scores: Float32Array, network: StarArrays) -> None:
    """Write Q1 and Q2, their standard deviations over the members and 1 for scenes in range, (num_windows, 5)."""
    rows = star_rows(stack)
    batch = _batch(rows, network)
    work, places = _work(batch, network.widest, network.widest_row)
    num_windows, num_members = len(rows.counts), len(network.matrices)
    sums = np.zeros((num_windows, 4))
    for member in range(num_members):
        logits = work[_add_member(network, member, batch, work, places) :]
        for window in range(num_windows):
            for question in range(2):
                one, other = logits[window * LANES + question], logits[(num_windows + window) * LANES + question]
                score = (1.0 / (1.0 + np.exp(-one)) + 1.0 / (1.0 + np.exp(-other))) / 2.0
                sums[window, question] += score
                sums[window, 2 + question] += score * score
    for window in range(num_windows):
        touching = False
        for kind in range(3):
            touching = touching or rows.surroundings[window, kind] <= network.contact[kind]
        for question in range(2):
            mean = sums[window, question] / num_members
            variance = sums[window, 2 + question] / num_members - mean * mean
            scores[window, question] = min(mean, network.limits[4]) if touching else mean
            scores[window, 2 + question] = np.sqrt(max(variance, 0.0))
        scores[window, 4] = _in_range(rows, window, network.facts)


@njit
def _in_range(rows: Rows, window: int, facts: FloatArray) -> bool:
    """Whether all facts of a scene, in the order of `reward_model.graph.facts`, lie within the training's."""
    room, counts = rows.rooms[window], rows.counts[window]
    found = np.empty(6)
    found[0], found[1], found[2] = rows.surroundings[window, 3], counts[0], counts[1]
    found[3], found[4] = 10.0 * room[1], SPEED_UNIT * abs(room[2])
    found[5] = TURN_UNIT * abs(room[ROOM_EVEN + 1])
    inside = True
    for place in range(len(found)):
        inside = inside and facts[0, place] <= found[place] <= facts[1, place]
    return inside


@njit
def _batch(rows: Rows, network: StarArrays) -> _Batch:
    sizes = (rows.people.size, rows.objects.size, rows.walls.size, rows.pairs.size, rows.rooms.size)
    columns = np.array(
        [rows.people.shape[1], rows.objects.shape[1], rows.walls.shape[1], rows.pairs.shape[1], rows.rooms.shape[1]]
    )
    starts = np.zeros(5, dtype=np.int64)
    for kind in range(_NUM_KINDS):
        starts[kind + 1] = starts[kind] + sizes[kind]
    inputs = np.empty(starts[_ROOMS] + sizes[_ROOMS], dtype=np.float32)
    limit = network.limits[0]
    _standardise(rows.people, network.inputs[0], limit, inputs[starts[0] :])
    _standardise(rows.objects, network.inputs[1], limit, inputs[starts[1] :])
    _standardise(rows.walls, network.inputs[2], limit, inputs[starts[2] :])
    _standardise(rows.pairs, network.inputs[3], limit, inputs[starts[3] :])
    _standardise(rows.rooms, network.inputs[4], limit, inputs[starts[4] :])
    firsts = np.zeros_like(rows.counts)
    totals = np.zeros(_NUM_KINDS, dtype=np.int64)
    scale = np.empty(len(rows.counts), dtype=np.float32)
    for window in range(len(rows.counts)):
        firsts[window] = totals
        totals += rows.counts[window]
        scale[window] = network.limits[1] / (rows.counts[window, :3].sum() + 2)
    return _Batch(inputs, starts, columns, rows.counts, firsts, totals, scale)


@njit
def _standardise(rows: Float32Array, inputs: Float32Array, limit: np.float32, out: Float32Array) -> None:
    place = 0
    for row in range(rows.shape[0]):
        for column in range(rows.shape[1]):
            value = (rows[row, column] - inputs[0, column]) * inputs[1, column]
            out[place] = min(max(value, -limit), limit)
            place += 1


@njit
def _work(batch: _Batch, widest: int, widest_row: int) -> tuple[Float32Array, _Places]:
    """The work array, and the places in it. It is kept small, so that it stays in a core's cache and in the heap."""
    num_windows = len(batch.counts)
    most = batch.totals.max() * widest_row
    hidden, spare = np.zeros(_NUM_KINDS, dtype=np.int64), np.zeros(_NUM_KINDS, dtype=np.int64)
    end = 0
    for kind in range(_NUM_KINDS):
        hidden[kind] = end
        spare[kind] = end + 2 * batch.totals[kind] * widest_row
        end += 4 * batch.totals[kind] * widest_row
    even = end
    odd = even + max(most, num_windows * widest)  # they hold parts of rooms as well
    both = odd + max(most, num_windows * widest)
    room = both + 2 * most
    next_room = room + 2 * num_windows * widest
    by_window = next_room + 2 * num_windows * widest
    by_window_odd = by_window + 2 * num_windows * widest
    pooled = by_window_odd + 2 * num_windows * widest
    logits = pooled + 4 * num_windows * widest
    factors = logits + 2 * batch.totals.max() * LANES
    places = _Places(hidden, spare, even, odd, both, room, next_room, by_window, by_window_odd, pooled, logits, factors)
    return np.empty(factors + 4 * batch.totals.max(), dtype=np.float32), places


@njit
def _add_member(network: StarArrays, member: int, batch: _Batch, work: Float32Array, places: _Places) -> int:
    """Compute a member, and return the place of its logits, (2 num_windows, 8), Q1 and Q2 first."""
    weights, matrices = network.weights, network.matrices[member]
    num_rooms = 2 * len(batch.counts)
    for kind in range(_NUM_KINDS):
        _encode(weights, matrices, kind, batch, work, places)
    room, other, width = places.room, places.next_room, matrices[FIRST_ROUND + ROUND_BIAS, 2]
    for number in range(network.num_rounds):
        first = FIRST_ROUND + number * PER_ROUND
        bias, columns = matrices[first + ROUND_BIAS, 0], matrices[first + ROUND_BIAS, 2]
        if number == 0:
            _add_rooms(weights, matrices, first + ROUND_BIAS, OWN_EVEN, batch, work, places.even, places.odd)
            _images(work, places.even, places.odd, room, (num_rooms // 2) * columns, _ANY)
        else:
            for kind in range(_NUM_KINDS):
                _add_context(weights, matrices, first, kind, batch, work, places, room, width)
            _fill(work, other, weights, bias, num_rooms, columns)
            by_room = matrices[first + ROUND_ROOM, 0]
            add_flat_product(work, room, width, weights, by_room, work, other, columns, num_rooms, width)
            room, other, width = other, room, columns
        for kind in range(_NUM_KINDS):
            _add_pooled(weights, matrices, network.limits, first, kind, batch, work, places, room, columns)
        _relu(work, room, num_rooms * columns)
    last = _layer(weights, matrices, LAST_BIAS, work, room, width, other, num_rooms)
    _relu(work, other, num_rooms * last)
    _layer(weights, matrices, SCORES_BIAS, work, other, last, room, num_rooms)
    return room


@njit
def _fill(work: Float32Array, start: int, weights: Float32Array, bias: int, rows: int, columns: int) -> None:
    """Copy a bias into every row."""
    out, source = work[start : start + rows * columns], weights[bias : bias + columns]
    place = 0
    for _ in range(rows):
        for column in range(columns):
            out[place] = source[column]
            place += 1


@njit
def _relu(work: Float32Array, start: int, size: int) -> None:
    rows = work[start : start + size]
    for place in range(size):
        rows[place] = max(rows[place], _ZERO)


@njit
def _images(work: Float32Array, even: int, odd: int, out: int, size: int, least: np.float32) -> None:
    """The sums of two parts, and behind them the differences, at least `least`."""
    first, second = work[even : even + size], work[odd : odd + size]
    sums, differences = work[out : out + size], work[out + size : out + 2 * size]
    for place in range(size):
        sums[place] = max(first[place] + second[place], least)
        differences[place] = max(first[place] - second[place], least)


@njit
def _layer(
    weights: Float32Array,
    matrices: IntArray,
    place: int,
    work: Float32Array,
    rows: int,
    width: int,
    out: int,
    count: int,
) -> int:
    """The affine map whose bias stands at a place and whose matrix stands behind it; returns its columns."""
    columns: int = matrices[place, 2]
    _fill(work, out, weights, matrices[place, 0], count, columns)
    add_flat_product(work, rows, width, weights, matrices[place + 1, 0], work, out, columns, count, width)
    return columns


@njit
def _add_rooms(
    weights: Float32Array,
    matrices: IntArray,
    bias: int,
    by_even: int,
    batch: _Batch,
    work: Float32Array,
    even: int,
    odd: int,
) -> None:
    """The rooms' even columns times a matrix, plus a bias, and the odd ones times the next matrix."""
    columns, num_windows = matrices[bias, 2], len(batch.counts)
    start, stride = batch.starts[_ROOMS], batch.columns[_ROOMS]
    _fill(work, even, weights, matrices[bias, 0], num_windows, columns)
    work[odd : odd + num_windows * columns] = 0.0
    matrix = matrices[by_even, 0]
    add_flat_product(batch.inputs, start, stride, weights, matrix, work, even, columns, num_windows, ROOM_EVEN)
    matrix, rest = matrices[by_even + 1, 0], stride - ROOM_EVEN
    add_flat_product(batch.inputs, start + ROOM_EVEN, stride, weights, matrix, work, odd, columns, num_windows, rest)


@njit
def _encode(
    weights: Float32Array, matrices: IntArray, kind: int, batch: _Batch, work: Float32Array, places: _Places
) -> None:
    """The first round's rows of a kind, of both images."""
    count, first = batch.totals[kind], kind * PER_KIND
    if count == 0:
        return
    columns, num_even = matrices[first + BIAS, 2], _EVEN_COLUMNS[kind]
    start, stride = batch.starts[kind], batch.columns[kind]
    by_window, by_window_odd = places.by_window, places.by_window_odd
    _add_rooms(weights, matrices, first + BIAS, first + ROOM_BY_EVEN, batch, work, by_window, by_window_odd)
    by_even, by_odd, rest = matrices[first + EVEN, 0], matrices[first + ODD, 0], stride - num_even
    for window in range(len(batch.counts)):
        rows, place = batch.counts[window, kind], batch.firsts[window, kind]
        source, shift, out = start + place * stride, window * columns, place * columns
        initial, even = by_window + shift, places.even + out
        put_flat_product(
            batch.inputs, source, stride, weights, by_even, work, initial, work, even, columns, rows, num_even, _ANY
        )
        initial, odd = by_window_odd + shift, places.odd + out
        put_flat_product(
            batch.inputs,
            source + num_even,
            stride,
            weights,
            by_odd,
            work,
            initial,
            work,
            odd,
            columns,
            rows,
            rest,
            _ANY,
        )
    _images(work, places.even, places.odd, places.both, count * columns, _ZERO)
    bias, wide = matrices[first + SECOND_BIAS, 0], matrices[first + SECOND_BIAS, 2]
    matrix, out = matrices[first + SECOND, 0], places.hidden[kind]
    put_flat_product(
        work, places.both, columns, weights, matrix, weights, bias, work, out, wide, 2 * count, columns, _ZERO
    )


@njit
def _add_context(
    weights: Float32Array,
    matrices: IntArray,
    first: int,
    kind: int,
    batch: _Batch,
    work: Float32Array,
    places: _Places,
    room: int,
    room_width: int,
) -> None:
    """The next round's rows of a kind, where the last but one stood."""
    count = 2 * batch.totals[kind]
    if count == 0:
        return
    columns, inner = matrices[first + ROW_BIAS + kind, 2], matrices[first + ROW + kind, 1]
    num_rooms, rows, out = 2 * len(batch.counts), places.hidden[kind], places.spare[kind]
    _fill(work, places.by_window, weights, matrices[first + ROW_BIAS + kind, 0], num_rooms, columns)
    matrix = matrices[first + ROW_CONTEXT + kind, 0]
    add_flat_product(work, room, room_width, weights, matrix, work, places.by_window, columns, num_rooms, room_width)
    by_row = matrices[first + ROW + kind, 0]
    for image in range(2):
        for window in range(len(batch.counts)):
            place = image * batch.totals[kind] + batch.firsts[window, kind]
            initial = places.by_window + (image * len(batch.counts) + window) * columns
            source, target, some = rows + place * inner, out + place * columns, batch.counts[window, kind]
            put_flat_product(
                work, source, inner, weights, by_row, work, initial, work, target, columns, some, inner, _ZERO
            )
    places.hidden[kind], places.spare[kind] = out, rows


@njit
def _add_pooled(
    weights: Float32Array,
    matrices: IntArray,
    limits: Float32Array,
    first: int,
    kind: int,
    batch: _Batch,
    work: Float32Array,
    places: _Places,
    room: int,
    room_columns: int,
) -> None:
    """Add to the rooms' rows what the sums of a kind's rows, and their means weighted by attention, contribute."""
    num_windows, count = len(batch.counts), batch.totals[kind]
    if count == 0:
        return
    width, rows = matrices[first + ATTENTION + kind, 1], places.hidden[kind]
    _factors(weights, matrices, limits, first, kind, batch, work, places, width)
    pooled = places.pooled
    work[pooled : pooled + 4 * num_windows * width] = 0.0
    for image in range(2):
        for window in range(num_windows):
            start = image * count + batch.firsts[window, kind]
            out = pooled + 2 * (image * num_windows + window) * width
            inner, factors = batch.counts[window, kind], places.factors + start
            if inner <= _MANY_ROWS:
                add_flat_product(work, factors, 2 * count, work, rows + start * width, work, out, width, 2, inner)
            else:
                _sum_in_doubles(work, factors, 2 * count, rows + start * width, out, width, inner)
    matrix, both = matrices[first + ROUND_POOLED + kind, 0], 2 * width
    add_flat_product(work, pooled, both, weights, matrix, work, room, room_columns, 2 * num_windows, both)


@njit
def _sum_in_doubles(work: Float32Array, factors: int, stride: int, rows: int, out: int, width: int, inner: int) -> None:
    """The same sums of very many rows, whose order would otherwise show in the scores."""
    for column in range(width):
        plain, weighted = 0.0, 0.0
        for row in range(inner):
            value = work[rows + row * width + column]
            plain += np.float64(work[factors + row]) * value
            weighted += np.float64(work[factors + stride + row]) * value
        work[out + column], work[out + width + column] = plain, weighted


@njit
def _factors(
    weights: Float32Array,
    matrices: IntArray,
    limits: Float32Array,
    first: int,
    kind: int,
    batch: _Batch,
    work: Float32Array,
    places: _Places,
    width: int,
) -> None:
    """Write (2, num_rows): the factor of each row in its window's sum, and in its mean."""
    num_windows, count = len(batch.counts), batch.totals[kind]
    num_rows, rows = 2 * count, places.hidden[kind]
    _fill(work, places.logits, weights, matrices[first + ATTENTION_BIAS + kind, 0], num_rows, LANES)
    matrix = matrices[first + ATTENTION + kind, 0]
    add_flat_product(work, rows, width, weights, matrix, work, places.logits, LANES, num_rows, width)
    logits = work[places.logits : places.logits + num_rows * LANES]
    sums = work[places.factors : places.factors + num_rows]
    means = work[places.factors + num_rows : places.factors + 2 * num_rows]
    most = limits[2]
    for row in range(num_rows):
        means[row] = min(max(logits[row * LANES], -most), most)
    apply_exp(means)
    for image in range(2):
        for window in range(num_windows):
            start = image * count + batch.firsts[window, kind]
            end, total, scale = start + batch.counts[window, kind], np.float64(limits[3]), batch.scale[window]
            for row in range(start, end):
                total += means[row]
            inverse = np.float32(1.0 / total)
            for row in range(start, end):
                sums[row] = scale
                means[row] *= inverse
