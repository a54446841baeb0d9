"""PySINDy and a linear black box on the recordings that `stillbeam diagnose` was given: python diagnosis.py [--cases PROVE N...] [--real REAL] --out PAGE.md

PROVE is a folder that `cargo xtask prove` left (cases and scores), REAL one that `cargo xtask prove --real` left. Every folder in them
holds model.toml, recordings with a side file that says `role = "train"` or `"held_out"`, and, if it gave one, the tool's answer.json.

Everybody gets the same recordings and is judged by the same number: the free run over the held-out recordings, driven by the recorded
input, offset and initial state fitted, root mean square of recorded minus simulated.
"""

import argparse
import importlib.metadata
import json
import os
import pathlib
import time
import tomllib
import warnings

# One core for everybody. Has to be said before numpy is loaded.
for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

import numpy as np
import pandas as pd
import pysindy as ps
from nfoursid.nfoursid import NFourSID
from scipy.optimize import least_squares
from scipy.signal import savgol_filter

# What PySINDy may choose from, and what its free run on the training recordings decides.
WINDOWS = (5, 11, 21)
THRESHOLDS = (0.01, 0.03, 0.1)
DEGREE = 3
# Orders and block rows of the subspace method, decided in the same way.
RANKS = (1, 2, 3, 4, 6)
BLOCK_ROWS = (15, 60)
# A run that leaves the recorded range this many times is a failure.
ASTRAY = 50.0
FAILED = float("inf")


class Recording:
    def __init__(self, path, columns):
        table = pd.read_csv(path)
        self.t = table["time_s"].to_numpy()
        self.dt = (self.t[-1] - self.t[0]) / (len(self.t) - 1)
        self.u = table[columns[0]].to_numpy()
        self.y = table[columns[1:]].to_numpy()
        side = path.with_suffix(".toml")
        self.held_out = side.exists() and tomllib.loads(side.read_text()).get("role") == "held_out"


class Task:
    """A folder with a model, recordings, and what there is of answers."""

    def __init__(self, folder):
        self.folder = folder
        self.model = tomllib.loads((folder / "model.toml").read_text())
        self.input = self.model["input"]["column"]
        self.outputs = [output["column"] for output in self.model["output"]]
        files = [f for f in sorted(folder.glob("*.csv")) if f.with_suffix(".toml").exists()]
        recordings = [Recording(f, [self.input, *self.outputs]) for f in files]
        self.train = [r for r in recordings if not r.held_out]
        self.held_out = [r for r in recordings if r.held_out]
        answer = folder / "answer.json"
        self.answer = json.loads(answer.read_text()) if answer.exists() else None
        # Processor time, where the bench has measured it; otherwise what the tool says, by the clock on the wall.
        self.seconds = None

    def ours(self):
        if self.answer is None:
            return "no answer", None, None
        effects = [f"{e['id']} at {e['location']}" for e in self.answer["effects"]]
        fits = [f for f in self.answer["fit"]["recordings"] if f["role"] == "held_out" and f["output"] == self.outputs[0]]
        best = [(f["extended"] or f["refitted_linear"])["rms"] for f in fits]
        rms = float(np.sqrt(np.mean(np.square(best)))) if best else None
        if "controller" in self.model and rms is not None:
            # A loop holds the position whatever the model lacks; the peers know nothing of it and run open loop.
            effects.append(f"in its loop {rms:.2e}")
            rms = None
        return f"{self.answer['verdict']}: {', '.join(effects) or 'no name'}", rms, self.seconds or self.answer["seconds"]


def closeness(simulate, recordings):
    """Root mean square over recordings, first output, offset taken out; infinite where a run goes astray."""
    squares, count = 0.0, 0
    for recording in recordings:
        y = simulate(recording)
        if y is None or not np.all(np.isfinite(y)):
            return FAILED
        error = recording.y[:, 0] - y
        error -= error.mean()
        squares, count = squares + float(error @ error), count + len(error)
    return (squares / count) ** 0.5


# --- PySINDy ---------------------------------------------------------------------------------------------------------------


def drive(recording, is_motion, window):
    """What acts on the machine: the input, or the acceleration of a prescribed motion."""
    return savgol_filter(recording.u, window, 4, deriv=2, delta=recording.dt) if is_motion else recording.u


class Sindy:
    """x = outputs and their rates, scaled; PySINDy finds the accelerations, as a whole or beside a nominal model's."""

    def __init__(self, task, beside_nominal):
        self.task, self.beside = task, beside_nominal
        self.n = len(task.outputs)
        self.is_motion = task.model["kind"] != "lumped" and not task.input.endswith(("_N", "_V"))
        self.nominal = nominal(task) if beside_nominal else None
        self.best = (FAILED, None, None)

    def states(self, recording, window):
        take = lambda order: savgol_filter(recording.y - recording.y.mean(axis=0), window, 4, deriv=order, delta=recording.dt, axis=0)
        return take(0), take(1), take(2), drive(recording, self.is_motion, window)[:, None]

    def fit(self):
        for window in WINDOWS:
            parts = [self.states(r, window) for r in self.task.train]
            self.scale = [np.maximum(np.std(np.vstack([p[k] for p in parts]), axis=0), 1e-12) for k in range(4)]
            for threshold in THRESHOLDS:
                run = self.one(parts, window, threshold)
                error = closeness(run, self.task.train)
                if error < self.best[0]:
                    self.best = (error, run, self.terms)
        return self

    def one(self, parts, window, threshold):
        y_scale, v_scale, a_scale, u_scale = self.scale
        xs, dots, us = [], [], []
        for y, v, a, u in parts:
            known = self.nominal(y, v, u) if self.beside else 0.0
            xs.append(np.hstack([y / y_scale, v / v_scale]))
            dots.append(np.hstack([v / v_scale, (a - known) / a_scale]))
            us.append(u / u_scale)
        library = ps.PolynomialLibrary(degree=DEGREE) + ps.CustomLibrary(
            library_functions=[lambda x: np.sign(x), lambda x: x * np.abs(x)],
            function_names=[lambda x: f"sign({x})", lambda x: f"{x}*abs({x})"],
        )
        model = ps.SINDy(optimizer=ps.STLSQ(threshold=threshold), feature_library=library)
        names = [f"y{k}" for k in range(self.n)] + [f"v{k}" for k in range(self.n)] + ["u"]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            model.fit(xs, t=self.task.train[0].dt, x_dot=dots, u=us, feature_names=names)
        found = model.coefficients()[self.n :]
        features = model.get_feature_names()
        self.terms = [[(c, f) for c, f in zip(row, features) if c != 0.0] for row in found]
        code = [compile(" + ".join(f"{c!r}*{python(f)}" for c, f in plain(row)) or "0.0", "found", "eval") for row in self.terms]
        return lambda recording: self.simulate(recording, code, window)

    def simulate(self, recording, code, window):
        y_scale, v_scale, a_scale, u_scale = self.scale
        n = self.n
        sign = lambda x: (x > 0) - (x < 0)
        most = ASTRAY * np.max(np.abs(recording.y - recording.y.mean(axis=0)), axis=0)

        def rate(state, u):
            names = {"sign": sign, "abs": abs, "u": float(u / u_scale[0])}
            for k in range(n):
                names[f"y{k}"] = float(state[k] / y_scale[k])
                names[f"v{k}"] = float(state[n + k] / v_scale[k])
            try:
                found = [eval(c, names) for c in code]  # noqa: S307 (compiled from PySINDy's own terms)
            except OverflowError:
                found = [FAILED] * n
            a = np.array(found) * a_scale
            if self.beside:
                a = a + self.nominal(state[None, :n], state[None, n:], np.array([[u]]))[0]
            return np.concatenate([state[n:], a])

        y, v, _, u = self.states(recording, window)
        u = u[:, 0]
        steps = max(1, int(np.ceil(recording.dt * self.fastest() / 0.25)))
        state = np.concatenate([y[0], v[0]])
        out = np.empty(len(u))
        h = recording.dt / steps
        for k in range(len(u)):
            out[k] = state[0]
            if not np.all(np.abs(state[:n]) < most):
                return None
            if k + 1 == len(u):
                break
            for s in range(steps):
                at = lambda share: u[k] + (u[k + 1] - u[k]) * (s + share) / steps
                one = rate(state, at(0.0))
                two = rate(state + 0.5 * h * one, at(0.5))
                three = rate(state + 0.5 * h * two, at(0.5))
                four = rate(state + h * three, at(1.0))
                state = state + h / 6.0 * (one + 2.0 * two + 2.0 * three + four)
        return out

    def fastest(self):
        """A rate in rad/s that the steps must follow: the ratio of accelerations to velocities."""
        return float(np.max(self.scale[2] / self.scale[1]))

    def named(self):
        """The terms that no linear model with an offset has."""
        linear = {f"{x}{k}" for x in "yv" for k in range(self.n)} | {"u", "1"}
        terms = [f for row in (self.best[2] or []) for _, f in row if f not in linear]
        shown = list(dict.fromkeys(pretty(term, self.n == 1) for term in terms))
        if not shown:
            return "nothing"
        return ", ".join(shown) if len(shown) <= 6 else f"{len(shown)} terms: {', '.join(shown[:4])}, ..."


def plain(row):
    return [(float(c), f) for c, f in row]


def python(feature):
    """`y0^2 v0` as Python; `sign(y0)` and `y0*abs(y0)` already are."""
    return "1.0" if feature == "1" else feature.replace("^", "**").replace(" ", "*")


def pretty(feature, single):
    """A term as in a formula; without numbers where there is but one position."""
    words = feature.replace("*abs", "·abs").replace(" ", "·")
    return "`" + (words.replace("y0", "y").replace("v0", "v") if single else words) + "`"


def nominal(task):
    """Accelerations by the model that the lab has; None if it does not give them in terms of the outputs."""
    model = task.model
    if model["kind"] == "lumped":
        bodies = [body["name"] for body in model["body"]]
        if [output["body"] for output in model["output"]] != bodies or any(o.get("quantity", "position") != "position" for o in model["output"]):
            return None
        mass = np.array([body["mass"] for body in model["body"]])

        def connect(kind, key):
            matrix = np.zeros((len(bodies), len(bodies)))
            for joint in model.get(kind, []):
                places = [bodies.index(b) for b in joint["between"] if b != "ground"]
                for a in places:
                    for b in places:
                        matrix[a, b] += joint[key] if a == b else -joint[key]
            return matrix

        k, c = connect("spring", "stiffness"), connect("damper", "damping")
        gain = np.zeros(len(bodies))
        gain[bodies.index(model["input"]["body"])] = model["input"].get("gain", 1.0)
        return lambda y, v, u: (u * gain - v @ c.T - y @ k.T) / mass
    if model["kind"] == "modal" and len(model["mode"]) == 1 and len(task.outputs) == 1:
        mode = model["mode"][0]
        omega = 2.0 * np.pi * mode["frequency_hz"]
        gain = mode["participation"][0] * model["input"].get("gain", 1.0)
        return lambda y, v, u: u * gain - 2.0 * mode["damping_ratio"] * omega * v - omega**2 * y
    return None


# --- linear black box ------------------------------------------------------------------------------------------------------


def subspace(task):
    """N4SID on every training recording and at every order; the free run over all of them decides."""
    best = (FAILED, None, None)
    for recording in task.train:
        names = [f"y{k}" for k in range(recording.y.shape[1])]
        u_scale, y_scale, mean = np.std(recording.u) or 1.0, np.std(recording.y, axis=0), recording.y.mean(axis=0)
        table = pd.DataFrame((recording.y - mean) / y_scale, columns=names)
        table["u"] = recording.u / u_scale
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            for block_rows in BLOCK_ROWS:
                found = NFourSID(table, output_columns=names, input_columns=["u"], num_block_rows=block_rows)
                found.subspace_identification()
                for rank in RANKS:
                    try:
                        system, _ = found.system_identification(rank=rank)
                    except (ValueError, np.linalg.LinAlgError):
                        continue
                    run = lambda r, s=system, us=u_scale, ys=y_scale: linear_run(s, r, us, ys)
                    error = closeness(run, task.train)
                    if error < best[0]:
                        best = (error, run, rank)
    return best


def linear_run(system, recording, u_scale, y_scale):
    """Free run with the initial state, which enters linearly, fitted beside the offset."""
    rank = system.a.shape[0]
    x = np.zeros((rank, 1 + rank))
    x[:, 1:] = np.eye(rank)
    out = np.empty((len(recording.u), 1 + rank))
    for k, u in enumerate(recording.u / u_scale):
        out[k] = (system.c @ x)[0]
        out[k, 0] += float(system.d[0, 0]) * u
        x = system.a @ x
        x[:, 0] += system.b[:, 0] * u
    if not np.all(np.isfinite(out)) or np.max(np.abs(out)) > 1e8:
        return None
    out *= y_scale[0]
    basis = np.column_stack([out[:, 1:], np.ones(len(out))])
    norm = np.maximum(np.linalg.norm(basis, axis=0), 1e-300)
    weights = np.linalg.lstsq(basis / norm, recording.y[:, 0] - out[:, 0], rcond=1e-10)[0]
    return out[:, 0] + (basis / norm) @ weights


# --- page ------------------------------------------------------------------------------------------------------------------


def rows(task):
    said, rms, seconds = task.ours()
    yield "stillbeam diagnose", said, rms, seconds
    for label, beside in (("PySINDy, all of the dynamics", False), ("PySINDy, discrepancy of the given model", True)):
        if beside and nominal(task) is None:
            yield label, "the given model has no state that is recorded", None, None
            continue
        begun = time.process_time()
        sindy = Sindy(task, beside).fit()
        seconds = time.process_time() - begun
        if sindy.best[1] is None:
            yield label, "every free run of the training recordings goes astray", FAILED, seconds
        else:
            yield label, sindy.named(), closeness(sindy.best[1], task.held_out), seconds
    begun = time.process_time()
    error, run, rank = subspace(task)
    seconds = time.process_time() - begun
    label = "linear black box (N4SID)"
    if run is None:
        yield label, "no stable model", FAILED, seconds
    else:
        yield label, f"nothing; order {rank}", closeness(run, task.held_out), seconds


def number(value, form):
    return "-" if value is None else "astray" if value == FAILED else format(value, form)


def table(title, task, note):
    lines = [f"### {title}", "", note, "", f"| | names | held-out rms of {task.outputs[0]} | s |", "|---|---|---|---|"]
    for label, names, rms, seconds in rows(task):
        print(f"{title}: {label}: {names}: {number(rms, '.3e')}, {number(seconds, '.1f')} s", flush=True)
        lines.append(f"| {label} | {names} | {number(rms, '.3e')} | {number(seconds, '.1f')} |")
    return [*lines, ""]


def main():
    words = argparse.ArgumentParser()
    words.add_argument("--cases", nargs="+", default=[])
    words.add_argument("--real")
    words.add_argument("--out", required=True)
    given = words.parse_args()
    versions = ", ".join(f"{name} {importlib.metadata.version(name)}" for name in ("pysindy", "nfoursid", "numpy", "scipy"))
    lines = [
        "## Peers on the same recordings",
        "",
        f"Made by `host-tests/peers/run_diagnosis` ({versions}). Everybody has the same training recordings and is judged by the free run over the held-out ones, offset fitted; `s` is processor "
        "time on one core, the choice of settings included (ours on real recordings: by the clock, on a busy computer). The peers are helped: every position is taken as a state, its rates by Savitzky-Golay filters; PySINDy may choose among all products up to the third degree, "
        f"`sign` and `x·abs(x)` of every state and the input, with its threshold ({', '.join(map(str, THRESHOLDS))}, all scaled) and the filter's window ({', '.join(map(str, WINDOWS))} samples) chosen by the free run over the training recordings; "
        "as discrepancy it learns what the lab's model (not refitted) leaves of the acceleration. y is a position, v its rate, u the input. A term is no law: what it means is for the reader to say.",
        "",
    ]
    if given.cases:
        prove = pathlib.Path(given.cases[0])
        for case in given.cases[1:]:
            score = json.loads((prove / "scores" / f"{int(case):04}.json").read_text())
            there = " + ".join(score["truth"] + score["outside"]) or "nothing"
            floor = score["held_out"][0]["floor"] if score["held_out"] else None
            if "input" not in tomllib.loads((prove / "cases" / f"{int(case):04}" / "model.toml").read_text()):
                print(f"case {case}: a free decay, passed over", flush=True)
                continue
            note = f"A sealed case, {score['concealment']}; left out: **{there}**. Nobody gets below {number(floor, '.3e')}."
            task = Task(prove / "cases" / f"{int(case):04}")
            task.seconds = score["seconds"]
            lines += table(f"Case {case}: {score['machine']}", task, note)
    if given.real:
        for folder in sorted(pathlib.Path(given.real).iterdir()):
            if not (folder / "model.toml").exists() or "input" not in tomllib.loads((folder / "model.toml").read_text()):
                print(f"{folder.name}: a free decay, passed over", flush=True)
                continue
            task = Task(folder)
            if any(np.isnan(recording.y).any() for recording in task.train):
                print(f"{folder.name}: values are missing, which the peers do not take, passed over", flush=True)
                continue
            lines += table(f"Recorded: {folder.name}", task, "A real machine: [real.md](real.md).")
    pathlib.Path(given.out).write_text("\n".join(lines))


if __name__ == "__main__":
    main()
