"""Draw the picture of README.md and that of the page on maps, and write both beside this script."""

from pathlib import Path

import jax
import numpy as np
from matplotlib.figure import Figure

import isojax as ij

jax.config.update("jax_enable_x64", True)
model = ij.paper.y_direction()
smap = ij.stability_map(model, np.linspace(1.0, 300.0, 300), np.linspace(3.6, 5.2, 240), coexisting=True)
folds = ij.fold_curve(model, amplitude_range=(50.0, 300.0), frequency_range=(3.5, 5.5))
response = ij.frequency_response(model, 150.0, (3.6, 5.2))

figure = Figure(figsize=(10.0, 3.9), layout="constrained")
plane, cut = figure.subplots(1, 2)
ij.plot.stability_map(smap, folds=folds, ax=plane)
ij.plot.frequency_response(response, ax=cut)
figure.savefig(Path(__file__).with_name("stability_map.png"), dpi=110)
ij.plot.response_curves(smap).savefig(Path(__file__).with_name("curves.png"), dpi=90)
