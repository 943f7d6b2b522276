"""Workers that drive, on this machine or behind any Dask scheduler, and the results that they leave as Parquet.

Workers may come and go: what a dead one was driving is driven again by another. A task that takes its worker down each time is given
up after `distributed.scheduler.allowed-failures` deaths and has no result.
"""

import contextlib
import json
import pathlib
import tempfile

import pyarrow as pa
import pyarrow.parquet as pq
from distributed import Client, LocalCluster, as_completed
from distributed.diagnostics.plugin import UploadFile

import drive

HERE = pathlib.Path(__file__).parent
ARCHIVES = HERE.parent.parent / "target" / "fmu"
# Rows between two part files: few enough that little is lost when this process is killed.
FLUSH = 8


def add_arguments(parser):
    """What every command of this folder takes."""
    parser.add_argument("--scheduler", metavar="ADDRESS", help="Dask scheduler, such as tcp://HOST:8786; without it a cluster on this machine")
    parser.add_argument("--workers", type=int, default=2, help="workers of the cluster on this machine")
    parser.add_argument("--archives", type=pathlib.Path, default=ARCHIVES, help="folder of the packed FMUs")
    parser.add_argument("--results", type=pathlib.Path, required=True, help="folder of the results; what lies there is not driven again")
    parser.add_argument("--step", type=float, default=0.01, help="communication step [s]")
    parser.add_argument("--stop", type=float, default=120.0, help="longest run [s]")


@contextlib.contextmanager
def connected(arguments):
    """A client whose workers have the FMUs and the code that drives them, also those that join later."""
    with contextlib.ExitStack() as stack:
        address = arguments.scheduler
        if address is None:
            # One run at a time in each process: two would wait for each other in the interpreter.
            cluster = LocalCluster(n_workers=arguments.workers, threads_per_worker=1, dashboard_address=None)
            address = stack.enter_context(cluster)
        client = stack.enter_context(Client(address))
        for name in (drive.PLANT, drive.CONTROLLER):
            archive = arguments.archives / name
            if not archive.is_file():
                raise SystemExit(f"{archive} is missing: run cargo fmu pack")
            client.register_plugin(UploadFile(str(archive), load=False), name=name)
        client.register_plugin(UploadFile(drive.__file__), name="drive")
        yield client


def run(client, tasks):
    """Drives tasks by their keys; yields keys with results as they come, `None` for a task that killed its workers."""
    futures = {client.submit(drive.evaluate, task, pure=False, retries=2): key for key, task in tasks.items()}
    for future in as_completed(futures):
        yield futures[future], None if future.status == "error" else future.result()


class Store:
    """Results by key, in a folder of Parquet files that any number of runs add to."""

    COLUMNS = {
        "key": pa.string(),
        "candidate": pa.string(),
        "situation": pa.string(),
        "figure": pa.float64(),
        "e_y_rms": pa.float64(),
        "e_psi_rms": pa.float64(),
        "v_x_rms": pa.float64(),
        "e_y_max": pa.float64(),
        "seconds": pa.float64(),
        "error": pa.string(),
    }

    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        self.folder.mkdir(parents=True, exist_ok=True)
        self.rows = {}
        self.waiting = []
        for file in sorted(self.folder.glob("part-*.parquet")):
            self.rows.update((row["key"], row) for row in pq.read_table(file).to_pylist())

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.flush()

    def add(self, key, candidate, situation, result):
        result = result or {"figure": 2.0 * drive.LOST, "error": "its workers died"}
        row = {"key": key, "candidate": json.dumps(candidate, sort_keys=True), "situation": situation, **result}
        self.rows[key] = {name: row.get(name) for name in self.COLUMNS}
        self.waiting.append(self.rows[key])
        if len(self.waiting) >= FLUSH:
            self.flush()

    def flush(self):
        if not self.waiting:
            return
        table = pa.Table.from_pylist(self.waiting, schema=pa.schema(list(self.COLUMNS.items())))
        # Written under another name first: a part is whole or not there.
        with tempfile.NamedTemporaryFile(dir=self.folder, delete=False) as file:
            pq.write_table(table, file)
        pathlib.Path(file.name).rename(self.folder / f"part-{len(list(self.folder.glob('part-*.parquet'))):06}.parquet")
        self.waiting.clear()


def key_of(candidate, situation, arguments):
    """The same task has the same key, in this run and in the next."""
    return json.dumps([candidate, situation, arguments.step, arguments.stop], sort_keys=True)


def drive_all(client, store, pairs, arguments):
    """Drives candidates in situations as far as the store does not know them; gives their figures in the order of the pairs.

    A candidate is a dictionary of the controller's parameters, a situation {"name": ..., "plant": {...}, "controller": {...}}.
    """
    keys = [key_of(candidate, situation, arguments) for candidate, situation in pairs]
    tasks = {}
    for key, (candidate, situation) in zip(keys, pairs):
        if key not in store.rows:
            controller = {**situation.get("controller", {}), **candidate}
            tasks[key] = {"plant": situation.get("plant", {}), "controller": controller, "step": arguments.step, "stop": arguments.stop}
    described = dict(zip(keys, pairs))
    for key, result in run(client, tasks):
        candidate, situation = described[key]
        store.add(key, candidate, situation["name"], result)
    store.flush()
    return [store.rows[key]["figure"] for key in keys]


def situations(file):
    """Situations from a JSON file, or the manoeuvre as it is."""
    if file is None:
        return [{"name": "double_lane_change", "plant": {"road": "double_lane_change"}}]
    return json.loads(pathlib.Path(file).read_text(encoding="utf-8"))
