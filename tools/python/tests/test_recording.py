"""Recordings: in and out of files, data frames and datasets, and what is refused."""

import pickle

import numpy as np
import pandas
import pytest

import stillbeam
from stillbeam import InputError, Recording


@pytest.fixture
def recording():
    time_s = np.arange(0.0, 1.0, 0.01)
    position_m = np.sin(time_s)
    position_m[7] = np.nan
    return Recording(time_s, {"position_m": position_m}, name="one", role="held_out", notes={"payload_kg": 1.5})


@pytest.mark.parametrize("extension", ["csv", "json"])
def test_what_is_saved_is_read_back(tmp_path, recording, extension):
    path = tmp_path / f"one.{extension}"
    recording.save(path)
    back = stillbeam.read(path)
    np.testing.assert_array_equal(back.time_s, recording.time_s)
    np.testing.assert_array_equal(back["position_m"], recording["position_m"])
    assert (back.role, back.notes["payload_kg"]) == ("held_out", 1.5)


def test_columns_are_taken_renamed_and_scaled(tmp_path):
    path = tmp_path / "lab.txt"
    path.write_text("millis;y\n" + "".join(f"{10 * k};{k},5\n" for k in range(20)))
    read = stillbeam.read(path, time="millis*0.001", columns={"tip_deflection_m": "y*0.001"})
    np.testing.assert_allclose(read["tip_deflection_m"], 1e-3 * (np.arange(20) + 0.5))
    assert read.rate_hz == pytest.approx(100.0)


def test_a_bad_cell_is_named_with_its_row_and_column(tmp_path):
    path = tmp_path / "bad.csv"
    path.write_text("time_s,force_N\n" + "".join(f"{k},{'x' if k == 3 else k}\n" for k in range(9)))
    with pytest.raises(InputError, match=r"bad\.csv.*row 5.*force_N"):
        stillbeam.read(path)


def test_a_file_that_is_not_there_is_no_internal_error():
    with pytest.raises(InputError, match="nowhere"):
        stillbeam.read("nowhere.csv")


@pytest.mark.parametrize(
    ("time_s", "columns"),
    [
        (np.arange(10.0)[::-1], {"force_N": np.zeros(10)}),
        (np.arange(10.0), {"force_N": np.zeros(9)}),
        (np.arange(10.0), {"force": np.zeros(10)}),
        (np.full(10, np.nan), {"force_N": np.zeros(10)}),
    ],
)
def test_what_no_reader_would_accept_is_refused_at_once(time_s, columns):
    with pytest.raises(InputError):
        Recording(time_s, columns)


def test_a_matrix_is_no_signal():
    with pytest.raises(ValueError, match="one dimension"):
        Recording(np.arange(10.0), {"force_N": np.zeros((10, 1))})


def test_any_array_of_numbers_is_taken():
    strided = np.zeros(20, dtype=np.float32)[::2]
    recording = Recording(list(range(10)), {"force_N": strided, "count_1": np.arange(10)})
    assert recording["force_N"].dtype == np.float64
    assert recording["count_1"][3] == 3.0


def test_a_missing_column_lists_those_there_are(recording):
    with pytest.raises(KeyError, match="position_m"):
        recording["force_N"]


def test_a_data_frame_goes_both_ways(recording):
    frame = recording.to_pandas()
    assert frame.index.name == "time_s"
    for given in (frame, frame.reset_index()):
        back = Recording.from_pandas(given)
        np.testing.assert_array_equal(back["position_m"], recording["position_m"])
        np.testing.assert_array_equal(back.time_s, recording.time_s)


def test_a_dataset_goes_both_ways(recording):
    back = Recording.from_xarray(recording.to_xarray())
    np.testing.assert_array_equal(back["position_m"], recording["position_m"])


def test_a_part_and_further_columns_are_recordings(recording):
    part = recording.between(0.2, 0.4)
    assert (part.time_s[0], len(part)) == (0.2, 21)
    more = recording.with_columns(force_N=np.ones(len(recording)))
    assert set(more) == {"position_m", "force_N"}


def test_it_shows_its_columns(recording):
    shown = recording._repr_html_()
    assert "position_m" in shown and "100 Hz" in shown
    assert len(recording.plot().axes) == 1


def test_a_frame_of_whatever_order_keeps_its_names():
    frame = pandas.DataFrame({"b_N": np.zeros(8), "time_s": np.arange(8.0), "a_m": np.ones(8)})
    assert list(Recording.from_pandas(frame)) == ["b_N", "a_m"]


@pytest.mark.parametrize("zone", [None, "Europe/Berlin"])
def test_dates_are_seconds_from_the_first(zone):
    dates = pandas.date_range("2025-01-01", periods=200, freq="5ms", tz=zone)
    assert Recording.from_pandas(pandas.DataFrame({"tip_m": np.zeros(200)}, index=dates)).rate_hz == pytest.approx(200.0)
    differences = np.arange(9) * np.timedelta64(5, "ms")
    np.testing.assert_allclose(Recording(differences, {"tip_m": np.zeros(9)}).time_s, 0.005 * np.arange(9))


@pytest.mark.parametrize("index", [None, pandas.Index(np.arange(9), name="time_ms")])
def test_a_frame_that_does_not_say_when_is_refused(index):
    frame = pandas.DataFrame({"time_ms": np.arange(9.0), "tip_m": np.zeros(9)}, index=index)
    with pytest.raises(InputError, match="time_s"):
        Recording.from_pandas(frame)


def test_masked_values_are_missing_and_what_is_no_number_is_refused():
    masked = np.ma.array(np.arange(9.0), mask=[1] + 8 * [0])
    assert np.isnan(Recording(np.arange(9.0), {"tip_m": masked})["tip_m"][0])
    for samples in (np.zeros(9, dtype=complex), np.zeros(9, dtype="timedelta64[s]"), ["x"] * 9):
        with pytest.raises(TypeError, match="real numbers"):
            Recording(np.arange(9.0), {"tip_m": samples})


def test_a_recording_is_a_copy_that_nobody_changes(recording):
    mine = np.zeros(9)
    made = Recording(np.arange(9.0), {"tip_m": mine})
    mine[:] = 1.0
    assert made["tip_m"].max() == 0.0
    with pytest.raises(ValueError, match="read-only"):
        made.time_s[0] = 5.0
    assert recording == recording and recording != made and len({recording, made}) == 2
    back = pickle.loads(pickle.dumps(recording))
    np.testing.assert_array_equal(back["position_m"], recording["position_m"])
