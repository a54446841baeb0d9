"""The firmware's core behind the console."""

import os
import signal
import threading

import numpy as np
import pytest

import stillbeam
from stillbeam import Board, InputError


def test_nothing_moves_before_enable():
    with Board("core") as board:
        assert board.drive_state != "enabled"
        with pytest.raises(InputError, match="the drive is off"):
            board.move(0.05)
        with pytest.raises(InputError, match="the drive is off"):
            board.record("move 50")


def test_a_move_ends_where_it_was_told():
    with Board("core") as board:
        board.enable()
        assert board.move(0.02) == pytest.approx(0.02, abs=1e-9)
        assert board.move(-0.01) == pytest.approx(-0.01, abs=1e-9)


def test_a_block_leaves_the_drive_as_it_found_it():
    board = Board("core")
    with pytest.raises(RuntimeError), board:
        board.enable()
        inner = board._board
        raise RuntimeError("something else went wrong")
    with pytest.raises(InputError, match="closed"):
        inner.drive_state()
    assert not board._is_open
    assert not board._enabled_here


def test_ctrl_c_at_whatever_moment_of_a_move_stops_the_machine():
    for delay_s in (0.0, 0.003, 0.011, 0.02, 0.035):
        with Board("core") as board:
            board.enable()
            board.command("set move.velocity_mm_s 20")
            board.command("apply")
            timer = threading.Timer(delay_s, os.kill, (os.getpid(), signal.SIGINT))
            with pytest.raises(KeyboardInterrupt):
                timer.start()
                while True:
                    board.move(0.1)
                    board.move(0.0)
            assert board.command("status")["state"] in ("stopping", "rest")
            assert board.wait() == board.wait()


def test_closing_disables_what_was_enabled_here_and_twice_is_once():
    with Board("core") as board:
        board.enable()
        board.close()
        board.close()
    assert not board._enabled_here
    with pytest.raises(InputError, match="closed"), board:
        pass


def test_the_board_runs_the_shaper_that_was_designed():
    shaper = stillbeam.shape([(1.1, 0.0074), (6.9, 0.0059)])
    with Board("core") as board:
        assert board.upload(shaper) == shaper.crc32
        board.command("shaper on")
        board.enable()
        recorded = board.record("move 50", decimation=1, after_s=0.1)
    _, expected_m = shaper.apply(recorded.time_s, recorded["command_m"])
    np.testing.assert_allclose(recorded["setpoint_m"], expected_m[: len(recorded)], atol=2e-9)
    assert recorded.remarks == ()


def test_a_reply_is_read_by_its_keys():
    with Board("core") as board:
        status = board.command("status")
        assert status["drive"] == board.drive_state
        with pytest.raises(KeyError, match="lines are"):
            status["no_such_key"]
        assert str(status).endswith(status.ok)


def test_a_refusal_is_the_boards_own():
    with Board("core") as board:
        with pytest.raises(InputError, match="no-such-command"):
            board.command("no-such-command")
        for line in ("status\nenable", "µ", " "):
            with pytest.raises(InputError, match="one line"):
                board.command(line)


def test_a_port_that_is_not_there_is_named():
    with pytest.raises(InputError, match="/dev/no-such-port"):
        Board("/dev/no-such-port")
