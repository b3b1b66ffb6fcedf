#!/usr/bin/env bash
# Question: the rake of an earthquake is unknown, NaN in the context. What style of faulting do models take in
# openquake.hazardlib?
# Guess: one of the styles, without a word.
# Came (openquake.engine 3.26.2): no word, and each model another style. BooreEtAl2014 takes normal faulting (PGA 20 % below
# strike-slip), ChiouYoungs2014, CampbellBozorgnia2014, AbrahamsonEtAl2014 and AkkarEtAlRjb2014 strike-slip, BindiEtAl2014Rjb
# alone unspecified faulting.
# Why it hurts: flatfiles and catalogues have events without a mechanism. Four models with weights then mix two styles, and a
# comparison of residuals blames the model. BooreEtAl2014 has coefficients for unspecified faulting, which are not used.
# This package: a model that needs the rake is refused without one, and NaN is no rake: tests/selection/test_models.py.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
# Without GDAL, which hazard models do not need, and of which pip has no wheel.
"$work/venv/bin/python" -m pip install --quiet --disable-pip-version-check --only-binary :all: numpy==2.2.6 \
    scipy==1.15.3 h5py==3.16.0 shapely==2.2.0 pyproj==3.7.2 toml==0.10.2 psutil==7.2.2 pandas==2.3.3 numba==0.61.2 \
    decorator==5.1.1 requests==2.34.2 pyzmq==26.0.3 docutils==0.19 h3==4.5.0 rtree==1.4.1 fiona==1.10.1 \
    alpha_shapes==1.1.1 matplotlib==3.11.2
"$work/venv/bin/python" -m pip install --quiet --disable-pip-version-check --no-deps openquake.engine==3.26.2
cd "$work"
"$work/venv/bin/python" -W ignore - <<'PYTHON'
import math
from importlib.metadata import version

from openquake.hazardlib.contexts import simple_cmaker
from openquake.hazardlib.gsim.abrahamson_2014 import AbrahamsonEtAl2014
from openquake.hazardlib.gsim.akkar_2014 import AkkarEtAlRjb2014
from openquake.hazardlib.gsim.bindi_2014 import BindiEtAl2014Rjb
from openquake.hazardlib.gsim.boore_2014 import BooreEtAl2014
from openquake.hazardlib.gsim.campbell_bozorgnia_2014 import CampbellBozorgnia2014
from openquake.hazardlib.gsim.chiou_youngs_2014 import ChiouYoungs2014

print("openquake.engine", version("openquake.engine"))
EVENT = {"mag": 6.5, "rjb": 20.0, "rrup": 20.0, "rx": 20.0, "dip": 90.0, "width": 10.0, "hypo_depth": 8.0,
         "vs30": 400.0, "z1pt0": 300.0, "z2pt5": 1.0, "vs30measured": True}
STYLES = {"unknown": math.nan, "strike-slip": 0.0, "reverse": 90.0, "normal": -90.0}


def median(model, rake):
    """Return the median PGA [g]."""
    maker = simple_cmaker([model()], ["PGA"])
    context = maker.new_ctx(1)
    for name, value in {**EVENT, "rake": rake}.items():
        if name in context.dtype.names:
            context[name] = value
    return math.exp(maker.get_mean_stds([context])[0, 0, 0, 0])


taken = {}
for model in (BooreEtAl2014, ChiouYoungs2014, CampbellBozorgnia2014, AbrahamsonEtAl2014, AkkarEtAlRjb2014,
              BindiEtAl2014Rjb):
    peaks = {style: median(model, rake) for style, rake in STYLES.items()}
    same = [style for style in list(STYLES)[1:] if abs(peaks[style] / peaks["unknown"] - 1.0) < 1e-9]
    taken[model.__name__] = same[:1]
    print(model.__name__, *(f"{style} {peak:.4f} g" for style, peak in peaks.items()), "unknown is:", same or "its own")
    if model is BooreEtAl2014:
        assert peaks["unknown"] < 0.81 * peaks["strike-slip"]
assert taken.pop("BooreEtAl2014") == ["normal"] and taken.pop("BindiEtAl2014Rjb") == []
assert all(same == ["strike-slip"] for same in taken.values()), taken
PYTHON
