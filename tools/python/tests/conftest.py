"""Machines that are simulated by SciPy alone, so that nothing of stillbeam judges itself."""

from pathlib import Path

import matplotlib
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import stillbeam

matplotlib.use("Agg")

REPOSITORY = Path(__file__).parents[3]


@pytest.fixture
def paper_beam():
    """The model file of the paper's beam."""
    return REPOSITORY / "models" / "paper_beam.toml"


@pytest.fixture
def ringing():
    """A free decay of two modes, with their frequencies and damping ratios."""
    modes = ((1.1, 0.0074, 1e-3), (6.9, 0.0059, 3e-4))
    time_s = np.arange(0.0, 40.0, 0.01)
    tip_m = 1e-6 * np.random.default_rng(1).standard_normal(len(time_s))
    for frequency_hz, damping_ratio, amplitude_m in modes:
        omega = 2.0 * np.pi * frequency_hz
        damped = omega * np.sqrt(1.0 - damping_ratio**2)
        tip_m += amplitude_m * np.exp(-damping_ratio * omega * time_s) * np.cos(damped * time_s)
    return stillbeam.Recording(time_s, {"tip_deflection_m": tip_m}, name="ringing"), modes


MASS_KG, STIFFNESS_N_M, DAMPING_N_S_M = 2.0, 800.0, 1.2

SLIDER = f"""
schema = 1
kind = "lumped"
[[body]]
name = "slider"
mass = {MASS_KG}
[[spring]]
between = ["slider", "ground"]
stiffness = {STIFFNESS_N_M}
[[damper]]
between = ["slider", "ground"]
damping = {DAMPING_N_S_M}
[input]
column = "force_N"
body = "slider"
[[output]]
column = "position_m"
body = "slider"
quantity = "position"
"""


@pytest.fixture
def slider():
    """A mass on a spring and a damper, pushed by a force."""
    return stillbeam.Model(SLIDER, "slider.toml")


def push(time_s, seed):
    """A smooth force of a few lines, newtons."""
    random = np.random.default_rng(seed)
    frequencies_hz, phases = random.uniform(0.3, 5.0, 8), random.uniform(0.0, 2.0 * np.pi, 8)
    return sum(2.0 * np.cos(2.0 * np.pi * f * time_s + p) for f, p in zip(frequencies_hz, phases, strict=True))


@pytest.fixture
def pushed_slider():
    """Records the slider: seed, a Coulomb friction in newtons, noise in metres."""

    def record(seed, *, friction_N=0.0, noise_m=2e-6, duration_s=20.0, rate_hz=100.0, mass_kg=MASS_KG):
        def rate(time_s, state):
            position_m, velocity_m_s = state
            # Smoothed over a speed that is far below the motion's.
            friction = friction_N * np.tanh(velocity_m_s / 1e-4)
            force = push(time_s, seed) - friction - DAMPING_N_S_M * velocity_m_s - STIFFNESS_N_M * position_m
            return velocity_m_s, force / mass_kg

        time_s = np.arange(0.0, duration_s, 1.0 / rate_hz)
        solved = solve_ivp(rate, (0.0, duration_s), (0.0, 0.0), "LSODA", time_s, rtol=1e-9, atol=1e-12)
        noise = noise_m * np.random.default_rng(1000 + seed).standard_normal(len(time_s))
        columns = {"force_N": push(time_s, seed), "position_m": solved.y[0] + noise}
        return stillbeam.Recording(time_s, columns, name=f"push {seed}")

    return record
