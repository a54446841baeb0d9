"""Diagnoses of a machine that SciPy simulates."""

import os
import signal
import threading
import time

import numpy as np
import pytest

import stillbeam
from stillbeam import InputError, Model


def test_a_right_model_is_called_adequate(slider, pushed_slider):
    found = stillbeam.diagnose(slider, [pushed_slider(1), pushed_slider(2)], pushed_slider(3))
    assert (found.verdict, found.effects) == ("adequate", ())
    assert "adequate" in found._repr_html_()


def test_a_wrong_mass_is_a_parameter_change(slider, pushed_slider):
    recorded = [pushed_slider(seed, mass_kg=2.4) for seed in (1, 2, 3)]
    found = stillbeam.diagnose(slider, recorded[:2], recorded[2])
    assert found.effects == ()
    simulated = stillbeam.simulate(found.refitted_model, recorded[2])
    assert np.std(simulated["position_m"] - recorded[2]["position_m"]) < 3e-6


def test_friction_that_was_left_out_is_named_and_modelled(slider, pushed_slider, tmp_path):
    recorded = [pushed_slider(seed, friction_N=0.8) for seed in (1, 2, 3)]
    steps = []
    found = stillbeam.diagnose(
        slider, recorded[:2], recorded[2], processor_limit_s=60.0, progress=lambda *step: steps.append(step)
    )
    named = [effect for effect in found.effects if effect.location == "slider" and "friction" in effect.id]
    assert named, found.sentence
    assert found.verdict in ("explained", "improved", "ambiguous")
    better = stillbeam.simulate(found.extended_model, recorded[2])["position_m"]
    given = stillbeam.simulate(slider, recorded[2])["position_m"]
    error = lambda position_m: np.std(position_m - recorded[2]["position_m"])  # noqa: E731
    assert error(better) < 0.1 * error(given)
    shares = [share for share, _ in steps]
    assert shares == sorted(shares) and 0.9 < shares[-1] <= 1.0
    assert all(words for _, words in steps)
    found.report(tmp_path / "report.html")
    assert (tmp_path / "report.html").read_text().startswith("<!DOCTYPE html>")
    assert len(found.plot().axes) == 1


def test_other_threads_run_meanwhile(slider, pushed_slider):
    counted = []

    def count():
        while not counted or counted[-1] is not None:
            counted.append(time.perf_counter())
            time.sleep(0.002)

    recorded = [pushed_slider(seed, friction_N=0.8) for seed in (1, 2)]
    thread = threading.Thread(target=count)
    thread.start()
    began = time.perf_counter()
    stillbeam.diagnose(slider, recorded, time_limit_s=2.0)
    took_s = time.perf_counter() - began
    counted.append(None)
    thread.join()
    # A thread that needs the interpreter's lock would have had no turn.
    assert len(counted) > 0.2 * took_s / 0.002


def test_ctrl_c_gives_control_back_at_once(slider, pushed_slider):
    recorded = [pushed_slider(seed, friction_N=0.8) for seed in (1, 2)]
    timer = threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT))
    began = time.perf_counter()
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        stillbeam.diagnose(slider, recorded, time_limit_s=20.0)
    assert time.perf_counter() - began < 5.0


def test_a_model_that_is_none_says_where():
    with pytest.raises(InputError, match=r"mine\.toml.*kind"):
        Model("schema = 1\nkind = 'beem'\n", "mine.toml")
    with pytest.raises(InputError, match="Model.read"):
        Model("mine.toml")
    with pytest.raises(TypeError, match="Model.read"):
        Model(None)


def test_what_was_not_looked_for_is_noted(slider, pushed_slider):
    recorded = [pushed_slider(seed, friction_N=0.8) for seed in (1, 2)]
    found = stillbeam.diagnose(slider, recorded, time_limit_s=0.01)
    assert any("ended" in note for note in found.notes)
    assert found.notes[0] in found._repr_html_() and "note" in repr(found)


def test_what_was_trained_on_does_not_judge(slider, pushed_slider):
    recorded = pushed_slider(1, duration_s=4.0)
    with pytest.raises(InputError, match="both trained on and held out"):
        stillbeam.diagnose(slider, recorded, recorded)
    with pytest.raises(InputError, match="limit"):
        stillbeam.diagnose(slider, recorded, time_limit_s=-1.0)


def test_a_progress_that_raises_is_reported_and_ends_nothing(slider, pushed_slider, monkeypatch):
    reported = []
    monkeypatch.setattr("sys.unraisablehook", reported.append)
    found = stillbeam.diagnose(slider, [pushed_slider(1), pushed_slider(2)], progress=lambda *_: 1 / 0)
    assert found.verdict == "adequate"
    assert any(isinstance(one.exc_value, ZeroDivisionError) for one in reported)


def test_limits_that_are_none_are_refused(slider, pushed_slider):
    recorded = pushed_slider(1, duration_s=4.0)
    with pytest.raises(InputError, match="above 0"):
        stillbeam.diagnose(slider, recorded, velocity_m_s=-0.1)
    with pytest.raises(InputError, match="travel"):
        stillbeam.diagnose(slider, recorded, travel_m=(0.1, -0.1))
