"""Runs pyOMA2's covariance-driven SSI on the ambient records in a folder: python output_only.py RECORDS PAGE.md

The folder holds, from `cargo run -p stillbeam-identify --example output_only_peers -- RECORDS`, one CSV per record and
ours.json: the truth and what stillbeam found.
"""

import contextlib
import csv
import importlib.metadata
import io
import json
import logging
import os
import pathlib
import statistics
import sys
import warnings

# One core for everybody: ours uses one, too. Has to be said before numpy is loaded.
for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

import numpy as np
from pyoma2.algorithms import SSI
from pyoma2.setup import SingleSetup

BLOCK_ROWS, HIGHEST_ORDER = 40, 32
# A pole counts as a mode's when it is this close.
NEAR = 0.02
PEER = "pyOMA2 SSI-cov"
ONE_OUTPUT = {"xi_max": 0.2, "mpc_lim": None, "mpd_lim": None, "CoV_max": None}


def read(path):
    with open(path, newline="") as file:
        rows = list(csv.reader(file))[1:]
    return np.array(rows, dtype=float)


def stable_poles(record, outputs):
    """Frequencies and damping ratios of the poles that its chart calls stable."""
    rate_hz = (len(record) - 1) / (record[-1, 0] - record[0, 0])
    with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        warnings.simplefilter("ignore")
        setup = SingleSetup(record[:, 1 : 1 + outputs], fs=rate_hz)
        # As its examples do: five samples per period of the highest mode.
        factor = int(rate_hz / (5 * record_top_hz(record, outputs, rate_hz)))
        if factor > 1:
            setup.decimate_data(q=factor)
        # One output has no shape that could be complex.
        hard = {"xi_max": 0.2, "mpc_lim": 0.5, "mpd_lim": 0.5, "CoV_max": 0.2} if outputs > 1 else ONE_OUTPUT
        algorithm = SSI(name="ssi", method="cov", br=BLOCK_ROWS, ordmax=HIGHEST_ORDER, hc=hard)
        setup.add_algorithms(algorithm)
        setup.run_by_name("ssi")
    result = algorithm.result
    stable = np.asarray(result.Lab) == 1
    return np.asarray(result.Fn_poles)[stable], np.asarray(result.Xi_poles)[stable]


def record_top_hz(record, outputs, rate_hz):
    """The highest peak of the spectrum: the help that a user gives by looking at it."""
    from scipy.signal import find_peaks, welch

    tops = []
    for output in range(outputs):
        frequency, density = welch(record[:, 1 + output], rate_hz, nperseg=2048)
        peaks, _ = find_peaks(np.log(density), prominence=np.log(20))
        tops += list(frequency[peaks])
    return max(tops, default=rate_hz / 10)


def nearest(found, truth_hz):
    """Median of the stable poles near a true frequency: more help than a user has."""
    frequency, damping = found
    near = np.abs(frequency / truth_hz - 1) < NEAR
    if near.sum() < 3:
        return None
    return float(np.median(frequency[near])), float(np.median(damping[near]))


def main(folder, page):
    logging.disable(logging.CRITICAL)
    folder = pathlib.Path(folder)
    ours = json.loads((folder / "ours.json").read_text())
    rows = []
    for outputs in (3, 1):
        theirs = []
        for record in ours["records"]:
            found = stable_poles(read(folder / f"{record['name']}.csv"), outputs)
            theirs.append([nearest(found, mode["frequency_hz"]) for mode in record["truth"]])
        own = [record["found"][str(outputs)] for record in ours["records"]]
        mine = [[mode and (mode["frequency_hz"], mode["damping_ratio"]) for mode in found] for found in own]
        rows.append(row(PEER, outputs, theirs, ours["records"]))
        rows.append(row("stillbeam", outputs, mine, ours["records"]))
    pathlib.Path(page).write_text(render(ours, rows))


def row(label, outputs, found, records):
    truths = [mode for record in records for mode in record["truth"]]
    pairs = [(mode, truth) for mode, truth in zip((m for one in found for m in one), truths) if heard(truth, outputs)]
    got = [(mode, truth) for mode, truth in pairs if mode]
    def error(index, key):
        return statistics.median(abs(mode[index] / truth[key] - 1) * 100 for mode, truth in got)

    return (
        f"| {label} | {outputs} | {len(got)} of {len(pairs)} | {error(0, 'frequency_hz'):.2g} | "
        f"{error(1, 'damping_ratio'):.2g} |"
    )


def heard(truth, outputs):
    """One output hears only modes of which it has a share."""
    return outputs > 1 or abs(truth["shape"][0]) > 0.2


def render(ours, rows):
    versions = ", ".join(f"{name} {importlib.metadata.version(name)}" for name in ("pyOMA_2", "numpy", "scipy"))
    held, modes = ours["held"], ours["modes"]
    return "\n".join(
        [
            "# Outputs alone, beside a peer",
            "",
            f"Made by `host-tests/peers/run_output_only` ({versions}).",
            "",
            f"{len(ours['records'])} records of three modes under white noise, 1500 periods of the lowest one long, three outputs with 1 % of "
            "sensor noise; damping ratios of 0.004 to 0.03. Errors are in percent of the truth, median over the modes that were found.",
            "",
            f"The peer is helped: block rows ({BLOCK_ROWS}), highest order ({HIGHEST_ORDER}) and the rate are set for it, and of the poles that it calls stable those within "
            f"{100 * NEAR:.0f} % of the true frequency count, their median is taken. stillbeam knows nothing of the truth and picks for itself.",
            "",
            "| method | outputs | modes found | frequency, % | damping ratio, % |",
            "|---|---|---|---|---|",
            *rows,
            "",
            f"Modes that stillbeam named and that are none: {ours['ghosts']}. Its intervals of 1.96 standard errors, three outputs, hold the true frequency of {held[0]} and the true damping ratio of "
            f"{held[1]} of {modes} modes.",
            "",
        ]
    )


if __name__ == "__main__":
    main(*sys.argv[1:])
