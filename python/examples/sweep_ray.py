"""The sweep by Ray: on two processes of this machine, or on the cluster that the first argument names.

pip install ray
python sweep_ray.py [auto]
"""

import pathlib
import sys

import ray

import sweep


def main(address=None):
    folder = str(pathlib.Path(sweep.__file__).parent)
    options = {"address": address} if address else {"num_cpus": 2, "include_dashboard": False}
    # Workers of other machines have the package, but not this folder.
    ray.init(
        **options, runtime_env={"working_dir": folder} if address else {"env_vars": {"PYTHONPATH": folder}}, log_to_driver=False
    )
    try:
        # One core for each part, so that times compare.
        measure = ray.remote(num_cpus=1)(sweep.measure)
        rows = ray.get([measure.remote(*part) for part in sweep.PARTS])
    finally:
        ray.shutdown()
    sweep.show(rows)


if __name__ == "__main__":
    main(*sys.argv[1:])
