"""
A map over two parameters of a study
====================================

Where does a block on a belt stick and slip? A study file, and values for two of its keys: all
cores run the cases, finished ones are kept in a folder, and an interrupted sweep goes on where it
ended.
On a cluster, give ``executor=fecontact.sweeps.dask_executor("tcp://SCHEDULER:8786")``.
"""

from pathlib import Path

import numpy as np

import fecontact as fc
from fecontact.plot import plot_sweep

# %%
# The block of the study file, over the speed of its belt and the coefficient of static friction.
folder = Path(fc.__file__).parents[1] / "examples"
study = fc.Study.read(folder / "sweep_stick_slip.toml")
study = study.with_({"simulation.t_end": 12.0, "simulation.outputs": 1201, "sweep.t_start": 9.0})
speeds, coefficients = np.linspace(1e-3, 12e-3, 12), np.linspace(0.6, 0.9, 5)

# %%
# Worker processes read this script too: what they must not do again stands below this line.
if __name__ == "__main__":
    table = fc.sweep(study, {"ground.speed": speeds, "friction.static_coefficient": coefficients},
                     folder="sweep")
    print(f"{len(table)} cases, {len(table.failed)} failed")
    for coefficient, amplitude in zip(coefficients, table.grid("amplitude_x").T,
                                      strict=True):
        last = np.max(speeds, where=amplitude > 1e-4, initial=0.0)
        print(f"mu_0 = {coefficient:5.3f}: sticks and slips up to {1e3 * last:4.1f} mm/s")
    plot_sweep(table, "amplitude_x", path="sweep_map.png")
