"""Modes, against signals whose modes are known."""

import json
import pickle

import control
import numpy as np
import pytest
import scipy.signal

import stillbeam
from stillbeam import InputError, Recording


def test_a_free_decay_gives_its_modes_within_their_errors(ringing):
    recording, truth = ringing
    found = stillbeam.identify(recording)
    assert found.kind == "free_decay"
    assert len(found) == len(truth)
    for mode, (frequency_hz, damping_ratio, _) in zip(found, truth, strict=True):
        assert abs(mode.frequency_hz.value - frequency_hz) < 4.0 * mode.frequency_hz.stderr
        assert abs(mode.damping_ratio.value - damping_ratio) < 4.0 * mode.damping_ratio.stderr
        assert mode.frequency_hz.stderr < 1e-4


def test_the_fit_is_beside_what_was_recorded(ringing):
    recording, _ = ringing
    fit = stillbeam.identify(recording).fit
    assert fit.time_s.shape == fit.measured.shape == fit.fitted.shape
    assert np.std(fit.measured - fit.fitted) < 1.1e-6


def test_a_forced_record_of_scipy_gives_the_poles_of_control():
    system = control.tf([1.0], [2.0, 1.2, 800.0]) + control.tf([0.4], [1.0, 0.9, 9000.0])
    frequencies = np.sort(np.abs(control.poles(system)))[::2] / (2.0 * np.pi)
    time_s = np.arange(0.0, 60.0, 0.005)
    force_N = scipy.signal.chirp(time_s, 0.5, 60.0, 25.0)
    _, position_m = control.forced_response(system, time_s, force_N)
    position_m = position_m + 1e-6 * np.random.default_rng(2).standard_normal(len(time_s))
    recording = Recording(time_s, {"force_N": force_N, "position_m": position_m})
    found = stillbeam.identify(recording, input="force_N")
    assert [mode.frequency_hz.value for mode in found] == pytest.approx(frequencies, rel=2e-4)
    expected = [1.2 / (2.0 * np.sqrt(2.0 * 800.0)), 0.9 / (2.0 * np.sqrt(9000.0))]
    assert [mode.damping_ratio.value for mode in found] == pytest.approx(expected, rel=0.03)
    assert found.frf is None or found.frf["response"].dtype == complex


def test_several_recordings_are_fitted_together_and_apart(pushed_slider):
    found = stillbeam.identify([pushed_slider(seed) for seed in (1, 2)], input="force_N", modes=1)
    assert len(found.results) == 3
    assert found[0].frequency_hz.value == pytest.approx(np.sqrt(800.0 / 2.0) / (2.0 * np.pi), rel=1e-4)


def test_the_file_of_modes_is_the_commands(tmp_path, ringing):
    found = stillbeam.identify(ringing[0])
    found.save(tmp_path / "modes.json")
    filed = json.loads((tmp_path / "modes.json").read_text())
    assert filed["modes"][0]["frequency_hz"]["value"] == found[0].frequency_hz.value
    assert stillbeam.shape(tmp_path / "modes.json").crc32 == stillbeam.shape(found).crc32


def test_a_file_and_the_recording_in_it_give_the_same(tmp_path, ringing):
    path = tmp_path / "ringing.csv"
    ringing[0].save(path)
    of_file, of_memory = stillbeam.identify(path), stillbeam.identify(ringing[0])
    assert of_file[0].frequency_hz == of_memory[0].frequency_hz


def test_a_driven_record_without_its_input_is_refused_with_a_remedy():
    time_s = np.arange(0.0, 30.0, 0.005)
    swept = scipy.signal.chirp(time_s, 1.0, 30.0, 20.0)
    with pytest.raises(InputError, match="input|sweep"):
        stillbeam.identify(Recording(time_s, {"tip_acceleration_m_s2": swept}))


def test_a_word_that_is_none_lists_those_there_are(ringing):
    with pytest.raises(InputError, match="force, base_position, base_acceleration"):
        stillbeam.identify(ringing[0], input_kind="push")
    with pytest.raises(InputError, match="input and sweep"):
        stillbeam.identify(ringing[0], input="a_m", sweep="1,20,30s")
    with pytest.raises(TypeError, match="rate"):
        stillbeam.identify(ringing[0], rate=100.0)


def test_an_estimate_computes_as_its_number_and_keeps_its_error(ringing):
    frequency_hz = stillbeam.identify(ringing[0])[0].frequency_hz
    assert 2.0 * frequency_hz == pytest.approx(2.2, rel=1e-3) and f"{frequency_hz:.2f}" == "1.10"
    back = pickle.loads(pickle.dumps(frequency_hz))
    assert (back, back.stderr) == (frequency_hz, frequency_hz.stderr) and back.stderr > 0.0
    assert "±" in str(frequency_hz)


def test_recordings_without_a_common_mode_say_so(ringing):
    time_s = np.arange(0.0, 20.0, 0.005)
    other = np.exp(-0.5 * time_s) * np.cos(2.0 * np.pi * 9.4 * time_s)
    other += 1e-3 * np.random.default_rng(3).standard_normal(len(time_s))
    found = stillbeam.identify([ringing[0], Recording(time_s, {"tip_deflection_m": other})])
    assert len(found) == 0 and any("common" in warning for warning in found.warnings)


@pytest.mark.parametrize("given", [{"tip_m": np.zeros(9)}, [np.zeros(9)], [3]])
def test_what_is_no_recording_says_how_to_make_one(given):
    with pytest.raises(TypeError, match="Recording"):
        stillbeam.identify(given)


def test_options_that_say_nothing_are_refused(ringing):
    with pytest.raises(TypeError, match="separator"):
        stillbeam.identify(ringing[0], separator="tab")
    with pytest.raises(InputError, match="at least one"):
        stillbeam.identify([])


def test_it_shows_its_modes(ringing):
    found = stillbeam.identify(ringing[0])
    assert "damping ratio" in found._repr_html_()
    assert "1.1" in repr(found)
    assert len(found.plot().axes) == 2
