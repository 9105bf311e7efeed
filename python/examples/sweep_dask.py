"""The sweep by Dask: on two processes of this machine, or on a cluster whose scheduler the first argument names.

pip install "dask[distributed]"
python sweep_dask.py [tcp://scheduler:8786]
"""

import pathlib
import sys

from dask.distributed import Client

import sweep


def main(scheduler=None):
    options = {"address": scheduler} if scheduler else {"n_workers": 2, "threads_per_worker": 1}
    with Client(**options) as client:
        # Workers of other machines have the package, but not this file.
        client.upload_file(str(pathlib.Path(sweep.__file__)))
        # As trees are built by one thread, times compare where a worker has a core of its own.
        rows = client.gather(client.map(sweep.measure, *zip(*sweep.PARTS), pure=False))
    sweep.show(rows)


if __name__ == "__main__":
    main(*sys.argv[1:])
