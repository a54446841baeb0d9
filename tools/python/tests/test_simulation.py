"""Simulations, against SciPy."""

import numpy as np
import pytest

import stillbeam
from stillbeam import InputError


def test_a_pushed_slider_moves_as_scipy_says(slider, pushed_slider):
    recorded = pushed_slider(3, noise_m=0.0)
    simulated = stillbeam.simulate(slider, recorded)
    error = simulated["position_m"] - recorded["position_m"]
    assert np.std(error) < 2e-5 * np.std(recorded["position_m"])


def test_a_shaped_move_leaves_the_beam_still(paper_beam):
    ringing = stillbeam.simulate_move(paper_beam, "move 50mm")
    modes = stillbeam.identify(_tail(ringing.recording), output="tip_deflection_m", modes=2)
    still = stillbeam.simulate_move(paper_beam, "move 50mm", shaper=stillbeam.shape(modes))
    assert still.vibration_pct < 0.05
    assert still.residual_peak_m < 1e-3 * ringing.residual_peak_m
    assert still.settling_time_s < 2.0
    assert "settling" in still._repr_html_()


def test_a_command_that_comes_back_is_an_excitation(paper_beam):
    command = "sweep linear 0.5 2 0.1Hz/s 200mm/s2"
    swept = stillbeam.simulate(paper_beam, command)
    assert np.ptp(swept["tip_deflection_m"]) > 1e-3
    with pytest.raises(InputError, match="use stillbeam.simulate"):
        stillbeam.simulate_move(paper_beam, command)


def test_what_does_not_fit_is_refused(paper_beam, slider, pushed_slider):
    with pytest.raises(InputError, match="its own times"):
        stillbeam.simulate(slider, pushed_slider(1, duration_s=2.0), rate_hz=1000.0)
    with pytest.raises(InputError, match="setpoint_m"):
        stillbeam.simulate(paper_beam, pushed_slider(1, duration_s=2.0))
    with pytest.raises(InputError, match="setpoint_m or base_position_m"):
        stillbeam.simulate(slider, "sweep linear 0.5 2 0.1Hz/s 200mm/s2")


def _tail(recording):
    """From when the setpoint has come to rest."""
    moving = np.flatnonzero(np.diff(recording["setpoint_m"]))
    return recording.between(recording.time_s[moving[-1] + 2], recording.time_s[-1])
