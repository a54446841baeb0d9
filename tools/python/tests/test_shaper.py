"""Shapers, against the textbook and against simulations by SciPy."""

import numpy as np
import pytest
import scipy.signal

import stillbeam
from stillbeam import InputError, Shaper

RATE_HZ = 4000.0


def test_a_zv_is_the_textbooks():
    frequency_hz, damping_ratio = 1.1, 0.0074
    shaper = stillbeam.shape([(frequency_hz, damping_ratio)], type="zv")
    decay = np.exp(-np.pi * damping_ratio / np.sqrt(1.0 - damping_ratio**2))
    half_period_s = 0.5 / (frequency_hz * np.sqrt(1.0 - damping_ratio**2))
    # The board places an impulse that lies between two ticks on both.
    assert np.sum(shaper.amplitude[shaper.time_s > 0.0]) == pytest.approx(decay / (1.0 + decay), abs=2e-4)
    later = shaper.time_s > 0.0
    centre_s = np.average(shaper.time_s[later], weights=shaper.amplitude[later])
    assert centre_s == pytest.approx(half_period_s, abs=1.0 / RATE_HZ)
    assert shaper.amplitude.sum() == pytest.approx(1.0)


@pytest.mark.parametrize("kind", ["zv", "zvd", "zvdd", "ei"])
@pytest.mark.parametrize("off", [0.95, 1.0, 1.04])
def test_the_vibration_left_is_what_a_simulated_mode_keeps(kind, off):
    frequency_hz, damping_ratio = 1.1, 0.0074
    shaper = stillbeam.shape([(frequency_hz, damping_ratio)], type=kind)
    omega = 2.0 * np.pi * frequency_hz * off
    mode = scipy.signal.lti([omega**2], [1.0, 2.0 * damping_ratio * omega, omega**2])
    time_s = np.arange(0.0, shaper.duration_s + 3.0 / frequency_hz, 1.0 / RATE_HZ)

    def envelope(command, from_s):
        _, output, state = scipy.signal.lsim(mode, command, time_s, interp=False)
        rate = np.gradient(output, time_s)
        at = np.searchsorted(time_s, from_s)
        damped = omega * np.sqrt(1.0 - damping_ratio**2)
        return np.hypot(output[at] - 1.0, (rate[at] + damping_ratio * omega * (output[at] - 1.0)) / damped)

    shaped = np.zeros_like(time_s)
    for impulse_s, amplitude in zip(shaper.time_s, shaper.amplitude, strict=True):
        shaped[time_s >= impulse_s - 0.5 / RATE_HZ] += amplitude
    from_s = shaper.duration_s + 2.0 / RATE_HZ
    unshaped = envelope(np.ones_like(time_s), from_s) * np.exp(damping_ratio * omega * from_s)
    decayed = unshaped * np.exp(-damping_ratio * omega * from_s)
    left = envelope(shaped, from_s) / unshaped
    assert left == pytest.approx(float(shaper.vibration(frequency_hz * off, damping_ratio)), abs=1.5e-3)
    assert decayed > 0.5


def test_what_the_board_makes_of_a_command_is_its_convolution():
    shaper = stillbeam.shape([(1.1, 0.0074), (6.9, 0.0059)])
    time_s = np.arange(0.0, 2.0, 1.0 / RATE_HZ)
    command_m = 0.05 * np.clip(time_s, 0.0, 1.0)
    shaped_s, setpoint_m = shaper.apply(time_s, command_m)
    expected = command_m
    for stage in shaper.stages:
        taps = np.zeros(stage.delay_ticks.max() + 1)
        np.add.at(taps, stage.delay_ticks, stage.weight / stage.weight_one)
        expected = np.convolve(expected, taps)[: len(command_m)]
    np.testing.assert_allclose(setpoint_m[: len(command_m)], expected, atol=3e-9)
    assert setpoint_m[-1] == pytest.approx(command_m[-1], abs=1e-9)
    assert shaped_s[-1] == pytest.approx(time_s[-1] + shaper.duration_s, abs=2.0 / RATE_HZ)


def test_the_shortest_shaper_holds_its_tolerance_over_the_box():
    modes = [(1.1, 0.0074), (6.9, 0.0059)]
    shaper = stillbeam.shape(modes, tolerance=0.02, box="5%")
    assert shaper.duration_s < stillbeam.shape(modes).duration_s
    assert shaper.residual_over_box.max() <= 0.02
    for frequency_hz, damping_ratio in modes:
        near = np.linspace(0.95, 1.05, 41) * frequency_hz
        assert shaper.vibration(near, damping_ratio).max() < 0.021


def test_a_mode_may_name_its_own_type():
    shaper = stillbeam.shape([(1.1, 0.0074), (6.9, 0.0059, "zvdd")], type="zv")
    assert [stage.type for stage in shaper.stages] == ["zv", "zvdd"]
    assert all(stage.weight.sum() == stage.weight_one for stage in shaper.stages)


def test_identified_modes_have_at_least_the_floor_as_their_box(ringing):
    found = stillbeam.identify(ringing[0])
    wide, narrow = stillbeam.shape(found, box_floor="10%"), stillbeam.shape(found, box_floor="1%")
    assert wide.residual_over_box.max() > 10.0 * narrow.residual_over_box.max()
    assert len(stillbeam.shape(found, use=[2]).stages) == 1


def test_some_of_the_identified_modes_are_shaped_with_their_boxes(ringing):
    found = stillbeam.identify(ringing[0])
    of_second = stillbeam.shape(found, use=2)
    assert stillbeam.shape(found[1:]).crc32 == of_second.crc32 == stillbeam.shape(found[1]).crc32
    assert stillbeam.shape(list(found)).crc32 == stillbeam.shape(found).crc32


def test_an_option_that_says_nothing_is_refused(ringing):
    found = stillbeam.identify(ringing[0])
    for modes, options, words in [
        (found, {"box": "20%"}, "box_floor"),
        ([(1.1, 0.01)], {"box_floor": "20%"}, "identified"),
        ([(1.1, 0.01)], {"use": 1}, "identified"),
        ([(1.1, 0.01)], {"box": "0.2"}, "percentages"),
        ([(1.1, 0.01)], {"box": 0.2}, "percentages"),
        ([(1.1, 0.01)], {"type": "zv", "tolerance": 0.02}, "leave type or tolerance out"),
    ]:
        with pytest.raises(InputError, match=words):
            stillbeam.shape(modes, **options)
    with pytest.raises(TypeError, match="frequency_hz, damping_ratio"):
        stillbeam.shape(ringing[0])


def test_what_is_no_table_or_shaper_says_so(tmp_path, paper_beam):
    (tmp_path / "r.csv").write_text("time_s,force_N\n")
    with pytest.raises(InputError, match="no table"):
        Shaper.read(tmp_path / "r.csv")
    with pytest.raises(TypeError, match="no shaper"):
        stillbeam.simulate_move(paper_beam, "move 50mm", shaper="zvd")


def test_a_table_is_read_back(tmp_path):
    shaper = stillbeam.shape([(1.1, 0.0074)])
    shaper.save(tmp_path / "table.json")
    assert Shaper.read(tmp_path / "table.json").crc32 == shaper.crc32


@pytest.mark.parametrize(
    ("modes", "kind", "words"),
    [([], "zvd", "mode"), ([(1.1, 1.5)], "zvd", "damping"), ([(1.1, 0.01)], "zvx", "zvx")],
)
def test_what_cannot_be_shaped_is_refused(modes, kind, words):
    with pytest.raises(InputError, match=words):
        stillbeam.shape(modes, type=kind)


def test_it_shows_itself():
    shaper = stillbeam.shape([(1.1, 0.0074)])
    assert "zvd" in shaper._repr_html_()
    assert len(shaper.plot().axes) == 2
    optimal = stillbeam.shape([(1.1, 0.0074), (6.9, 0.0059)], tolerance=0.05)
    assert "optimal" in optimal._repr_html_()
