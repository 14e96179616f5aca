"""Keyboard and joystick input of the window: driving, overlays, quitting."""

from __future__ import annotations

from typing import Final

import pygame

DEAD_ZONE: Final = 0.1  # of a joystick's axis, which never rests exactly in the middle
DRIVE_KEYS: Final = {
    pygame.K_UP: (1.0, 0.0, 0.0),  # forward, left, turn
    pygame.K_DOWN: (-1.0, 0.0, 0.0),
    pygame.K_LEFT: (0.0, 0.0, 1.0),
    pygame.K_RIGHT: (0.0, 0.0, -1.0),
    pygame.K_a: (0.0, 1.0, 0.0),
    pygame.K_d: (0.0, -1.0, 0.0),
}


class Controls:
    """The state of the keyboard and the joystick.

    heatmap: whether h has been pressed an odd number of times; rings: the same for p
    quit: whether the window was closed, or escape pressed
    again: whether the space bar was pressed since this was last set to False
    """

    def __init__(self) -> None:
        self.heatmap = self.rings = self.quit = self.again = False
        self._held: set[int] = set()
        self._axes: dict[int, float] = {}
        self._joysticks: list[pygame.joystick.JoystickType] = []

    def listen(self) -> None:
        """Process the input since the last call; needs an open window."""
        for event in pygame.event.get():
            if event.type == pygame.QUIT:
                self.quit = True
            elif event.type == pygame.KEYDOWN:
                self._press(event.key)
            elif event.type == pygame.KEYUP:
                self._held.discard(event.key)
            elif event.type == pygame.JOYDEVICEADDED:
                self._joysticks.append(pygame.joystick.Joystick(event.device_index))
            elif event.type == pygame.JOYAXISMOTION:
                self._axes[event.axis] = event.value if abs(event.value) > DEAD_ZONE else 0.0

    @property
    def drive(self) -> tuple[float, float, float]:
        """Forward, left and turn, -1 to 1 each: the arrow keys, a and d, or a joystick's first two axes."""
        forward = -self._axes.get(1, 0.0)
        left, turn = 0.0, -self._axes.get(0, 0.0)
        for key in self._held:
            more = DRIVE_KEYS.get(key, (0.0, 0.0, 0.0))
            forward, left, turn = forward + more[0], left + more[1], turn + more[2]
        return _limited(forward), _limited(left), _limited(turn)

    def _press(self, key: int) -> None:
        self._held.add(key)
        if key == pygame.K_h:
            self.heatmap = not self.heatmap
        elif key == pygame.K_p:
            self.rings = not self.rings
        elif key == pygame.K_ESCAPE:
            self.quit = True
        elif key == pygame.K_SPACE:
            self.again = True


def _limited(value: float) -> float:
    return min(max(value, -1.0), 1.0)
