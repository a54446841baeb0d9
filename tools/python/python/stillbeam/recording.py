"""Recordings: stamps and named columns."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _stillbeam
from .display import html_table, pyplot

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.figure import Figure

TIME = "time_s"


@dataclass(frozen=True, eq=False)
class Recording:
    """What was measured, or simulated.

    The name of every column ends in its unit, such as ``force_N`` or ``tip_deflection_m``. A missing value is
    NaN, or masked. ``recording["force_N"]`` is a column. Arrays are copied, and the recording's are read-only.
    Stamps may also be dates or time differences of NumPy or pandas: dates count from the first.
    """

    time_s: np.ndarray
    """Stamps in seconds, shape (n,), strictly increasing, not necessarily even."""
    columns: Mapping[str, np.ndarray]
    """The measured columns by name, each of shape (n,), in the unit of its name."""
    name: str = "recording"
    """What messages call it: the file it came from."""
    role: str | None = None
    """``"train"``, ``"held_out"``, or nothing said."""
    notes: Mapping[str, Any] = field(default_factory=dict)
    """What the side file says besides."""
    remarks: tuple[str, ...] = ()
    """What the reader understood and left out."""

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        set_(self, "time_s", stamps(self.time_s))
        set_(self, "columns", {name: signal(name, samples) for name, samples in self.columns.items()})
        _stillbeam.check(self._parts())

    @classmethod
    def from_pandas(cls, frame: pandas.DataFrame, *, name: str = "recording", role: str | None = None) -> Recording:
        """From a data frame whose columns are named with their units.

        The stamps are in the column ``time_s``, or in an index that is called so or has dates or time
        differences.
        """
        if not hasattr(frame, "columns"):
            raise TypeError("give a data frame whose columns are named with their units; series.to_frame() makes one")
        if TIME in frame.columns:
            time_s = frame[TIME].to_numpy()
        elif frame.index.name == TIME or frame.index.dtype.kind in "mM":
            time_s = frame.index.to_numpy()
        else:
            raise _stillbeam.InputError(
                f"{name}: the frame does not say when its rows were taken: it has no column {TIME}, and its index is "
                f"neither called so nor has dates; frame.assign({TIME}=...) or frame.index.name = {TIME!r} says it"
            )
        columns = {column: frame[column].to_numpy() for column in frame.columns if column != TIME}
        return cls(time_s, columns, name=name, role=role)

    @classmethod
    def from_xarray(cls, dataset: xarray.Dataset, *, name: str = "recording", role: str | None = None) -> Recording:
        """From a dataset whose variables are named with their units, over the coordinate ``time_s``."""
        if not hasattr(dataset, "data_vars"):
            raise TypeError("give a dataset whose variables are named with their units; array.to_dataset() makes one")
        columns = {str(variable): dataset[variable].to_numpy() for variable in dataset.data_vars}
        return cls(dataset[TIME].to_numpy(), columns, name=name, role=role)

    def __getitem__(self, column: str) -> np.ndarray:
        if column == TIME:
            return self.time_s
        try:
            return self.columns[column]
        except KeyError:
            present = ", ".join(self.columns)
            raise KeyError(f"{self.name}: there is no column {column!r}; there are {present}") from None

    def __iter__(self) -> Iterator[str]:
        return iter(self.columns)

    def __len__(self) -> int:
        return len(self.time_s)

    @property
    def duration_s(self) -> float:
        """From the first stamp to the last, seconds."""
        return float(self.time_s[-1] - self.time_s[0])

    @property
    def rate_hz(self) -> float:
        """Samples per second, on average."""
        return (len(self) - 1) / self.duration_s

    def with_columns(self, **columns: np.ndarray) -> Recording:
        """The same with further columns, or others in place of those of the same name."""
        return Recording(self.time_s, {**self.columns, **columns}, self.name, self.role, self.notes, self.remarks)

    def between(self, from_s: float | None, to_s: float | None) -> Recording:
        """The part from one time to another, both included; ``None`` is the beginning, or the end."""
        first = self.time_s[0] if from_s is None else from_s
        last = self.time_s[-1] if to_s is None else to_s
        part = (self.time_s >= first) & (self.time_s <= last)
        columns = {name: samples[part] for name, samples in self.columns.items()}
        return Recording(self.time_s[part], columns, self.name, self.role, self.notes, self.remarks)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes it in the format of the file's extension (``.csv``, ``.uff``, ``.json``); a role and notes go
        to a side file of the same stem."""
        _stillbeam.write(self._parts(), os.fspath(path))

    def to_pandas(self) -> pandas.DataFrame:
        """A data frame whose index is ``time_s``."""
        import pandas

        return pandas.DataFrame(dict(self.columns), index=pandas.Index(self.time_s, name=TIME))

    def to_xarray(self) -> xarray.Dataset:
        """A dataset over the coordinate ``time_s``."""
        import xarray

        variables = {name: (TIME, samples) for name, samples in self.columns.items()}
        return xarray.Dataset(variables, coords={TIME: self.time_s}, attrs=dict(self.notes))

    def plot(self, columns: str | Iterable[str] | None = None) -> Figure:
        """Columns over time, one below the other; by default all."""
        plt = pyplot()
        names = [columns] if isinstance(columns, str) else list(self.columns if columns is None else columns)
        figure, axes = plt.subplots(len(names), 1, sharex=True, squeeze=False, figsize=(8, 1.8 * len(names) + 0.6))
        for axis, name in zip(axes[:, 0], names, strict=True):
            axis.plot(self.time_s, self[name], linewidth=0.8)
            axis.set_ylabel(name)
        axes[-1, 0].set_xlabel("time (s)")
        figure.suptitle(self.name)
        return figure

    def _repr_html_(self) -> str:
        rows = [
            (name, f"{np.nanmin(samples):.4g}", f"{np.nanmax(samples):.4g}", f"{np.nanstd(samples):.3g}",
             int(np.isnan(samples).sum()))
            for name, samples in self.columns.items()
        ]
        title = f"{self.name}: {len(self)} samples, {self.duration_s:.4g} s, {self.rate_hz:.5g} Hz"
        return html_table(title, ("column", "lowest", "highest", "standard deviation", "missing"), rows)

    def __repr__(self) -> str:
        return f"Recording({self.name!r}, {len(self)} samples, {self.duration_s:.4g} s, {', '.join(self.columns)})"

    def _parts(self) -> tuple[Any, ...]:
        notes = json.dumps(dict(self.notes), default=str)
        return self.name, self.time_s, list(self.columns.items()), self.role, notes

    @classmethod
    def _of(cls, parts: tuple[Any, ...], remarks: Iterable[str] = ()) -> Recording:
        name, time_s, columns, role, notes = parts
        return cls(time_s, dict(columns), name, role, json.loads(notes), tuple(remarks))


def read(
    path: str | os.PathLike[str],
    *,
    format: str | None = None,
    time: str | None = None,
    sample_rate_hz: float | None = None,
    columns: Mapping[str, str] | Iterable[str] = (),
    skip_lines: int | None = None,
    separator: str | None = None,
    decimal: str | None = None,
) -> Recording:
    """Reads a recording in any format that stillbeam knows, told apart by its content.

    Parameters
    ----------
    path
        The file.
    format
        ``"csv"``, ``"klipper"``, ``"lvm"``, ``"uff58"``, ``"mat"``, ``"npy"``, ``"wav"`` and so on, where the
        content does not show it.
    time
        Where the time is and how many seconds its unit is: ``"millis*0.001"``.
    sample_rate_hz
        Samples per second, of files that hold no time or wrong stamps.
    columns
        The columns to take: ``{"tip_deflection_m": "y*0.001"}``. By default all whose name or label states a
        unit.
    skip_lines, separator, decimal
        Of a table of text: lines to leave out before it, ``"comma"``, ``"semicolon"``, ``"tab"`` or
        ``"blanks"``, and ``"."`` or ``","``. By default what its content shows.

    Raises
    ------
    InputError
        It names file, row, column and the remedy.
    """
    reading = reading_options(
        format=format,
        time=time,
        sample_rate_hz=sample_rate_hz,
        columns=columns,
        skip_lines=skip_lines,
        separator=separator,
        decimal=decimal,
    )
    parts, _format, remarks = _stillbeam.read(os.fspath(path), reading)
    return Recording._of(parts, remarks)


def reading_options(**given: Any) -> dict[str, Any]:
    """The options of :func:`read`, as the readers take them."""
    names = ("format", "time", "sample_rate_hz", "columns", "skip_lines", "separator", "decimal")
    unknown = set(given) - set(names)
    if unknown:
        raise TypeError(f"no such option of reading: {', '.join(sorted(unknown))}; there are {', '.join(names)}")
    options = {name: given.get(name) for name in names}
    columns = given.get("columns") or ()
    if isinstance(columns, Mapping):
        columns = [f"{name}={source}" for name, source in columns.items()]
    options["columns"] = [columns] if isinstance(columns, str) else list(columns)
    return options


def as_recording(given: Recording | str | os.PathLike[str]) -> Recording:
    """A recording, or the one in a file."""
    return given if isinstance(given, Recording) else read(given)


def as_list(given: Any) -> list[Recording | str | os.PathLike[str]]:
    """One recording or file, or several.

    Raises
    ------
    TypeError
        For anything else, with what makes a recording of it.
    """
    one = (Recording, str, os.PathLike)
    if isinstance(given, Mapping) or hasattr(given, "columns") and not isinstance(given, Recording):
        raise TypeError(
            f"a {type(given).__name__} is no recording: Recording.from_pandas(frame) or Recording(time_s, columns) makes one"
        )
    several = [given] if isinstance(given, one) else list(given)
    for other in (item for item in several if not isinstance(item, one)):
        raise TypeError(f"a {type(other).__name__} is no recording; give a Recording, or the path of a file")
    return several


def stamps(given: Any) -> np.ndarray:
    """Stamps in seconds; dates count from the first."""
    times = np.asarray(given)
    if times.dtype == object:
        # Dates with a time zone.
        times = np.array([np.datetime64(getattr(time, "to_datetime64", lambda time=time: time)()) for time in times])
    if times.dtype.kind == "M":
        times = times - times[:1]
    if times.dtype.kind == "m":
        return signal(TIME, times / np.timedelta64(1, "s"))
    return signal(TIME, times)


def signal(name: str, given: Any) -> np.ndarray:
    """A read-only copy; masked values are missing."""
    samples = given
    if isinstance(given, np.ma.MaskedArray):
        samples = given.astype(np.float64).filled(np.nan)
    samples = np.asarray(samples)
    if samples.dtype == object:
        samples = samples.astype(np.float64)
    if samples.dtype.kind not in "biuf":
        raise TypeError(f"{name}: a signal has real numbers, not {samples.dtype}; make numbers of them first")
    if samples.ndim != 1:
        raise ValueError(f"{name}: a signal has one dimension, not the shape {samples.shape}; give one column each")
    copy = np.array(samples, dtype=np.float64, order="C")
    copy.flags.writeable = False
    return copy
