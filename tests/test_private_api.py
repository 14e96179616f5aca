"""Private parts of other libraries that the project uses: a version without them is named here, and who needs them.

What they compute is tested elsewhere: physics against `pymunk.Space.step`, products against NumPy's.
"""

from __future__ import annotations

import importlib
from importlib.metadata import requires, version

import pytest
from packaging.requirements import Requirement

PHYSICS, NUMBA, MATMUL = "socnav_env/simulation/physics.py", "reward_model/base/numba.py", "reward_model/fast/matmul.py"

USED = [
    ("pymunk", "pymunk._chipmunk_cffi", "ffi", PHYSICS),
    *(
        ("pymunk", "pymunk._chipmunk_cffi", f"lib.{name}", PHYSICS)
        for name in (
            "cpSpaceStep",
            "cpSpaceEachBody",
            "pmSpaceBodyGetIteratorFuncBatched",
            "pmSpaceBodySetIteratorFuncBatched",
        )
    ),
    ("pymunk", "pymunk.batch", "BodyFields.ANGULAR_VELOCITY", PHYSICS),
    ("numba", "numba.core.dispatcher", "Dispatcher.get_call_template", NUMBA),
    ("numba", "numba.core.types", "unliteral", NUMBA),
    ("numba", "numba.extending", "intrinsic", f"{NUMBA} and {MATMUL}"),
    *(("numba", "numba.core.cgutils", name, MATMUL) for name in ("for_range", "get_or_insert_function")),
    ("numba", "numba.core.base", "BaseContext.make_array", MATMUL),
    ("numba", "numba.core.base", "BaseContext.get_dummy_value", f"{NUMBA} and {MATMUL}"),
    *(("llvmlite", "llvmlite.ir", name, MATMUL) for name in ("VectorType", "FunctionType", "Undefined", "Constant")),
    *(
        ("llvmlite", "llvmlite.ir", f"IRBuilder.{name}", MATMUL)
        for name in (
            "extract_value",
            "goto_entry_block",
            "icmp_signed",
            "if_then",
            "insert_element",
            "inttoptr",
            "sdiv",
            "shuffle_vector",
        )
    ),
]


def broken(library: str, what: str, user: str) -> str:
    return f"{library} {version(library)} has no {what}, which {user} uses: cap {library} in pyproject.toml or mend it"


@pytest.mark.parametrize(("library", "module", "name", "user"), USED, ids=lambda value: str(value).rsplit("/")[-1])
def test_it_is_there(library: str, module: str, name: str, user: str) -> None:
    found = importlib.import_module(module)
    for part in name.split("."):
        assert hasattr(found, part), broken(library, f"{module}.{name}", user)
        found = getattr(found, part)


def test_spaces_can_be_taken_apart() -> None:
    import pymunk

    space = pymunk.Space()
    for name in ("_space", "_handlers"):
        assert hasattr(space, name), broken("pymunk", f"Space.{name}", PHYSICS)
    space.on_collision(1, 2, post_solve=lambda *_: None)
    for part in (*space._handlers.values(), space.static_body):
        assert vars(part), broken("pymunk", "attributes of handlers and bodies that can be cleared", PHYSICS)


def test_buffers_of_chipmunk_have_their_fields() -> None:
    from pymunk._chipmunk_cffi import ffi

    fields = {name: {field for field, _ in ffi.typeof(name).fields} for name in ("pmFloatArray", "pmBatchedData")}
    for name, needed in (("pmFloatArray", {"num", "max", "arr"}), ("pmBatchedData", {"fields", "floatArray"})):
        assert needed <= fields[name], broken("pymunk", f"{name} with {needed}", PHYSICS)


def test_compiled_functions_have_entry_points() -> None:
    from reward_model.base.numba import njit

    @njit
    def double(number: int) -> int:
        return 2 * number

    double(1)
    (overload,) = double.overloads.values()
    assert overload.entry_point(4) == 8, broken("numba", "callable overloads[...].entry_point", NUMBA)


@pytest.mark.parametrize("library", ["llvmlite", "numba", "pymunk"])
def test_versions_that_were_not_tested_stay_out(library: str) -> None:
    (needed,) = (each for each in map(Requirement, requires("socnav2") or ()) if each.name == library)
    assert any(each.operator == "<" for each in needed.specifier), f"{library} needs an upper bound in pyproject.toml"
    assert needed.specifier.contains(version(library))
