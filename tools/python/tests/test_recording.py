"""Recordings: in and out of files, data frames and datasets, and what is refused."""

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
    frame = pandas.DataFrame({"b_N": np.zeros(8), "a_m": np.ones(8)}, index=np.arange(8.0))
    assert list(Recording.from_pandas(frame)) == ["b_N", "a_m"]
