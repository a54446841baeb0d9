"""The board, over its serial console."""

from __future__ import annotations

import os
from dataclasses import dataclass
from types import TracebackType

from . import _stillbeam
from .recording import Recording
from .shaper import Shaper, table_of


@dataclass(frozen=True)
class Reply:
    """What the board answered."""

    lines: tuple[str, ...]
    """The lines before the last."""
    ok: str
    """The last line, which begins with ``ok``."""

    def __getitem__(self, key: str) -> str:
        """The rest of the line that begins with ``key``, as in ``board.command("status")["drive"]``."""
        for line in self.lines:
            word, _, rest = line.partition(" ")
            if word == key:
                return rest
        raise KeyError(f"the reply has no line {key!r}; its lines are {', '.join(self.lines)}")

    def __str__(self) -> str:
        return "\n".join((*self.lines, self.ok))


class Board:
    """A conversation with a board's console.

    Nothing moves before :meth:`enable`. Ctrl-C during a call of this class brings the machine to a controlled
    stop. A drive that was enabled here is disabled by :meth:`close` and at the end of a ``with`` block,
    whatever happened; use one, so that Ctrl-C between calls ends in a stop as well.

    Parameters
    ----------
    port
        The serial port, such as ``"/dev/ttyACM0"`` or ``"COM3"``; ``"core"`` for the firmware's core in this
        process, or ``"qemu"`` for its image in an emulator, where nothing real moves.

    Raises
    ------
    InputError
        A port that cannot be opened, or nobody who answers.
    """

    def __init__(self, port: str | os.PathLike[str]) -> None:
        self.port = os.fspath(port)
        self._board = _stillbeam.Board(os.fspath(port))
        self._enabled_here = False
        self._is_open = True

    def command(self, line: str) -> Reply:
        """Sends one line of the console and waits for the end of its reply.

        Raises
        ------
        InputError
            The board's own refusal.
        """
        lines, ok = self._board.command(line)
        return Reply(tuple(lines), ok)

    @property
    def drive_state(self) -> str:
        """``"not_ready"``, ``"disabled"``, ``"enabling"``, ``"enabled"``, ``"stopping"`` or ``"fault"``."""
        return self._board.drive_state()

    def enable(self) -> None:
        """Lets the drive run and waits until it does: from here on the machine moves when it is told to.

        Boards without hardware are told that nothing is wired and that they stand at zero.
        """
        was_enabled = self.drive_state == "enabled"
        self._board.enable()
        self._enabled_here = self._enabled_here or not was_enabled

    def disable(self) -> None:
        """Brings the setpoint to rest, switches the drive off and waits until it is."""
        self._board.disable()
        self._enabled_here = False

    def stop(self) -> None:
        """A controlled stop; the drive stays enabled."""
        self.command("stop")

    def wait(self) -> float:
        """Waits until nothing moves and returns the position, metres."""
        return self._board.wait() * 1e-9

    def move(self, position_m: float) -> float:
        """Moves to a position, metres, and waits until the setpoint has come to rest.

        Returns
        -------
        float
            The position, metres.
        """
        try:
            self.command(f"move {1e3 * float(position_m)!r}")
            return self.wait()
        except KeyboardInterrupt:
            # It may have come between the two.
            self._board.interrupt()
            raise

    def record(self, motion: str, *, decimation: int | None = None, after_s: float = 2.0) -> Recording:
        """Runs a motion and takes what the board streams.

        Parameters
        ----------
        motion
            In the console's words, lengths in mm: ``"move 50"``, ``"sweep exponential 0.1 8 80 1.0"``.
        decimation
            Ticks per sample; by default as many as make about 1000 samples a second.
        after_s
            Seconds to go on after the setpoint has come to rest, to see the machine ring.

        Returns
        -------
        Recording
            Columns ``command_m``, ``setpoint_m``, ``encoder_m`` where there is an encoder, the inputs and the
            state. Lost samples are NaN; ``remarks`` says how many there are, and which fault ended the motion.
        """
        parts, lost, faults = self._board.record(motion, decimation, after_s)
        remarks = [f"a fault ended the motion: {fault}" for fault in faults]
        if lost:
            remarks.append(f"{lost} sample(s) were lost; stream fewer with a larger decimation")
        return Recording._of(parts, remarks)

    def upload(self, shaper: Shaper, *, save: bool = False) -> str:
        """Sends a shaper's table and lets it run, at rest or in the middle of a move, without a jump.

        Parameters
        ----------
        save
            Store it, with all settings that run, in the board's flash.

        Returns
        -------
        str
            The CRC-32 of what the board runs, which is the shaper's.
        """
        return self._board.upload(table_of(shaper), save)

    def close(self) -> None:
        """Disables the drive if it was enabled here, and ends the conversation."""
        if not self._is_open:
            return
        try:
            if self._enabled_here:
                self.disable()
        finally:
            self._is_open = False
            self._board.close()

    def __enter__(self) -> Board:
        if not self._is_open:
            raise _stillbeam.InputError(f"the line to {self.port} was closed; make a new Board")
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        raised: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"Board({self.port!r})"
