"""The same simulation with SciPy: 60 s of a two-mode beam at 10 kHz, base free under a force.

    python3 -m venv venv && venv/bin/pip install -r host-tests/peers/requirements.txt
    venv/bin/python host-tests/peers/simulation_speed.py [STATE_SPACE.json]

Prints the processor time of `scipy.signal.lsim` (first-order hold, exact as ours) and of `scipy.integrate.solve_ivp`
(DOP853, rtol 1e-9, at the same times; one run, on 6 s, times ten), and the tip's and base's rms, to be compared with
`cargo run --profile host -p stillbeam-plant --example minute_at_10_khz`.
"""

import json
import statistics
import sys
import time

import numpy as np
from scipy import signal
from scipy.integrate import solve_ivp

RATE_HZ = 10_000
TICKS = 600_000


def main():
    with open(sys.argv[1] if len(sys.argv) > 1 else "state_space.json") as file:
        given = json.load(file)
    a = np.array(given["a"])
    b = np.array(given["b"]).reshape(-1, 1)
    c = np.array(given["c"])
    t = np.arange(TICKS) / RATE_HZ
    u = 0.01 * np.sin(t * t)
    times = []
    for _ in range(5):
        start = time.process_time()
        _, y, _ = signal.lsim((a, b, c, np.zeros((c.shape[0], 1))), u, t)
        times.append(1e3 * (time.process_time() - start))
    print(f"lsim, processor time: median {statistics.median(times):.0f} ms, least {min(times):.0f} ms of {len(times)}")
    print("rms of the outputs:", *(f"{value:.9e}" for value in np.sqrt(np.mean(y**2, axis=0))))

    part = TICKS // 10
    start = time.process_time()
    solved = solve_ivp(
        lambda now, x: a @ x + b[:, 0] * np.interp(now, t, u),
        (0.0, t[part - 1]),
        np.zeros(len(a)),
        method="DOP853",
        rtol=1e-9,
        atol=1e-12,
        t_eval=t[:part],
        max_step=1e-2,
    )
    spent = 1e4 * (time.process_time() - start)
    print(f"solve_ivp (DOP853), processor time, 6 s times ten: {spent:.0f} ms")
    error = np.max(np.abs(c @ solved.y - y[:part].T), axis=1) / np.max(np.abs(y[:part]), axis=0)
    print("difference of the two, relative:", *(f"{value:.1e}" for value in error))


main()
