"""Fleets on a local cluster of two workers."""

import importlib
import json
import os
import signal
import sys

import cloudpickle
import numpy as np
import pandas
import pytest
from distributed import Client, LocalCluster, WorkerPlugin

import stillbeam
from stillbeam import fleet
from stillbeam.fleet.journal import Journal


@pytest.fixture(scope="module")
def client():
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as cluster, Client(cluster) as client:
        yield client


def ringing(seed, *, frequency_hz=1.1, seconds=20.0):
    """A free decay of one machine."""
    time_s = np.arange(0.0, seconds, 0.01)
    omega = 2.0 * np.pi * frequency_hz
    tip_m = 1e-3 * np.exp(-0.01 * omega * time_s) * np.cos(omega * time_s)
    tip_m += 1e-5 * np.random.default_rng(seed).standard_normal(len(time_s))
    return stillbeam.Recording(time_s, {"tip_deflection_m": tip_m}, name=f"machine {seed}")


def machines(count, odd=()):
    random = np.random.default_rng(0)
    frequencies_hz = 1.1 * (1.0 + 0.005 * random.standard_normal(count))
    return [
        fleet.Machine(f"m{k:03}", [ringing(k, frequency_hz=1.3 if k in odd else frequencies_hz[k])])
        for k in range(count)
    ]


def test_every_machine_is_in_the_table_once_and_the_odd_one_is_named(tmp_path, client):
    survey = fleet.identify(machines(12, odd=[7]), tmp_path, client=client)
    table = pandas.read_parquet(tmp_path / "table.parquet")
    frequencies = table[(table["where"] == "mode 1") & (table["quantity"] == "frequency")]
    assert sorted(frequencies.machine) == [f"m{k:03}" for k in range(12)]
    assert frequencies.value.median() == pytest.approx(1.1, rel=0.01)
    frequency = survey.differences[0]
    assert frequency.quantity == "frequency"
    assert frequency.far_out == ("m007",)
    assert 0.002 < frequency.relative_spread < 0.01 and frequency.stderr < 0.2 * frequency.spread
    page = (tmp_path / "page.html").read_text()
    assert "Unlike the others: m007" in page and "12 machines" in page


def test_a_second_run_does_nothing_again_but_what_changed(tmp_path, client):
    fleet.identify(machines(4), tmp_path, client=client)
    began = [entry["seconds"] for entry in _lines(tmp_path)]
    told = []
    changed = machines(5)
    changed[2] = fleet.Machine("m002", [ringing(2, frequency_hz=1.2)])
    survey = fleet.identify(changed, tmp_path, client=client, told=lambda *step: told.append(step))
    assert [entry["machine"] for entry in _lines(tmp_path)][len(began) :] in (["m002", "m004"], ["m004", "m002"])
    assert told == [(4, 5), (5, 5)]
    assert len(survey) == 5 and survey.failed == {}


def test_a_machine_that_fails_is_said_and_tried_again(tmp_path, client):
    missing = fleet.Machine("gone", [tmp_path / "gone.csv"])
    survey = fleet.identify([*machines(3), missing], tmp_path / "out", client=client)
    assert "gone.csv" in survey.failed["gone"]
    assert "gone.csv" in (tmp_path / "out" / "page.html").read_text()
    ringing(9).save(tmp_path / "gone.csv")
    assert fleet.identify([*machines(3), missing], tmp_path / "out", client=client).failed == {}


def test_half_a_line_of_a_killed_run_is_passed_over(tmp_path, client):
    fleet.identify(machines(2), tmp_path, client=client)
    with (tmp_path / "journal.jsonl").open("a") as file:
        file.write('{"machine": "m0')
    assert len(fleet.identify(machines(3), tmp_path, client=client)) == 3
    assert all(Journal(tmp_path / "journal.jsonl").entry(f"m{k:03}") for k in range(3))


def test_a_worker_that_is_killed_loses_nothing_and_doubles_nothing(tmp_path):
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as cluster, Client(cluster) as client:
        processes = client.run(os.getpid)
        killed = []

        def kill_one(done, _of):
            if done == 3 and not killed:
                killed.append(next(iter(processes.values())))
                os.kill(killed[0], signal.SIGKILL)

        survey = fleet.identify(machines(24), tmp_path, client=client, told=kill_one)
    assert killed
    assert sorted(entry["machine"] for entry in _lines(tmp_path)) == [f"m{k:03}" for k in range(24)]
    assert survey.failed == {} and len(survey) == 24


class DiesOfOneMachine(WorkerPlugin):
    """Workers, those that are started again too, that one machine ends."""

    def setup(self, worker):
        tasks = importlib.import_module("stillbeam.fleet.work").TASKS
        usual = tasks["identify"]
        tasks["identify"] = lambda machine, options: os._exit(1) if machine.name == "deadly" else usual(machine, options)


def test_a_machine_that_kills_its_workers_is_said_and_the_others_are_done(tmp_path):
    cloudpickle.register_pickle_by_value(sys.modules[__name__])
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as cluster, Client(cluster) as client:
        client.register_plugin(DiesOfOneMachine())
        survey = fleet.identify([fleet.Machine("deadly", [ringing(9)]), *machines(3)], tmp_path, client=client)
    cloudpickle.unregister_pickle_by_value(sys.modules[__name__])
    assert list(survey.failed) == ["deadly"] and "died" in survey.failed["deadly"]
    assert len(survey) == 4


def test_in_a_notebook_a_survey_leaves_the_page_around_it_alone(tmp_path, client):
    shown = fleet.identify(machines(4), tmp_path, client=client)._repr_html_()
    assert "4 machines" in shown and "<svg" in shown
    assert "<style" not in shown and "<body" not in shown


def test_diagnoses_of_a_fleet_are_counted_by_verdict(tmp_path, client, slider, pushed_slider):
    tasks = [
        fleet.Machine(f"slider {k}", [pushed_slider(3 * k), pushed_slider(3 * k + 1)], [pushed_slider(3 * k + 2)], slider)
        for k in range(2)
    ]
    survey = fleet.diagnose([*tasks, fleet.Machine("bare", [pushed_slider(1)])], tmp_path, client=client)
    table = survey.table
    assert list(table[table["what"] == "verdict"]["quantity"]) == ["adequate", "adequate"]
    assert "needs a model" in survey.failed["bare"]
    assert "adequate" in (tmp_path / "page.html").read_text()


def test_two_machines_of_one_name_are_refused(tmp_path):
    with pytest.raises(ValueError, match="called a"):
        fleet.identify([fleet.Machine("a", []), fleet.Machine("a", [])], tmp_path)


def _lines(folder):
    return [json.loads(line) for line in (folder / "journal.jsonl").read_text().splitlines()]
