"""How much of two workers a fleet uses: machines of half a second each, on one worker and on two.

``python benchmarks/fleet_efficiency.py [MACHINES]`` prints seconds and efficiency: the time on one worker over
twice the time on two.
"""

import os
import sys
import tempfile
import time

os.environ.setdefault("RAYON_NUM_THREADS", "1")

import numpy as np  # noqa: E402
from distributed import Client, LocalCluster  # noqa: E402

import stillbeam  # noqa: E402
from stillbeam import fleet  # noqa: E402


def ringing(seed):
    """A free decay of 400 s with one mode, and noise."""
    time_s = np.arange(0.0, 400.0, 0.01)
    tip_m = 1e-3 * np.exp(-0.02 * time_s) * np.cos(6.9 * time_s)
    tip_m += 1e-5 * np.random.default_rng(seed).standard_normal(len(time_s))
    return stillbeam.Recording(time_s, {"tip_deflection_m": tip_m}, name=f"machine {seed}")


def wall_s(workers, machines, folder):
    """Seconds from the first machine to the last, the cluster up and warm."""
    with LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=":0") as cluster:
        with Client(cluster) as client:
            client.wait_for_workers(workers)
            warm = [fleet.Machine(f"warm {k}", [ringing(1000 + k)]) for k in range(2 * workers)]
            fleet.identify(warm, f"{folder}/warm", client=client)
            began = time.perf_counter()
            fleet.identify(machines, f"{folder}/survey", client=client)
            return time.perf_counter() - began


def main():
    machines = [fleet.Machine(f"m{k}", [ringing(k)]) for k in range(int(sys.argv[1]) if len(sys.argv) > 1 else 32)]
    times = {}
    for workers in (1, 2):
        with tempfile.TemporaryDirectory() as folder:
            times[workers] = wall_s(workers, machines, folder)
        print(f"{workers} worker(s): {times[workers]:.2f} s, {times[workers] / len(machines):.3f} s a machine")
    print(f"efficiency on two workers: {times[1] / times[2] / 2:.2f}")


if __name__ == "__main__":
    main()
