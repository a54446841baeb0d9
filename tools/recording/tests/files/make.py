"""Writes the files of this folder with other people's writers, so that the readers are not tested against
themselves. Needs: pip install numpy==2.4.6 scipy==1.17.1 pyuff==2.5.8

    python make.py
"""

import pathlib
import warnings

import numpy as np
import pyuff
from scipy.io import savemat, wavfile

warnings.simplefilter("ignore")
HERE = pathlib.Path(__file__).parent

t = np.arange(40) * 0.01
tip = 1e-3 * np.exp(-0.5 * t) * np.cos(6.9 * t)
force = 2.0 * np.sin(3.0 * t)
uneven = t + 1e-4 * (np.arange(40) % 3)


def mat(name, contents, **options):
    savemat(HERE / name, contents, oned_as="column", **options)


conventional = {"time_s": t, "tip_deflection_m": tip, "force_N": force, "note": "text", "spare": np.zeros((2, 2))}
mat("conventional_v6.mat", conventional)
mat("conventional_v7.mat", conventional, do_compression=True)
foreign = {"run1": {"t": t, "Y": np.column_stack([tip * 1e3, force])}, "raw": (force * 1000).astype(np.int16),
           "z": np.array([1 + 2j, 3.0])}
mat("foreign_v7.mat", foreign, do_compression=True)
mat("rows_with_rate.mat", {"rate_hz": 100.0, "accel_m_s2": np.vstack([tip, force])}, do_compression=True)


def function(number, values, label, quantity, **more):
    return {
        "type": 58, "binary": 0, "func_type": 1, "id1": f"run {number}", "id2": "", "id3": "", "id4": "", "id5": "",
        "func_num": number, "ver_num": 1, "load_case_id": 0, "rsp_ent_name": "beam", "rsp_node": number,
        "rsp_dir": 3, "ref_ent_name": "NONE", "ref_node": 0, "ref_dir": 0, "ord_data_type": 4, "num_pts": len(values),
        "abscissa_spacing": 1, "abscissa_min": 0.0, "abscissa_inc": 0.01, "z_axis_value": 0.0,
        "abscissa_spec_data_type": 17, "abscissa_axis_lab": "Time", "abscissa_axis_units_lab": "s",
        "ordinate_spec_data_type": quantity, "ordinate_axis_lab": "", "ordinate_axis_units_lab": label,
        "orddenom_spec_data_type": 0, "orddenom_axis_lab": "NONE", "orddenom_axis_units_lab": "NONE",
        "z_axis_spec_data_type": 0, "z_axis_axis_lab": "NONE", "z_axis_axis_units_lab": "NONE",
        "x": t, "data": values, **more,
    }


def uff(name, functions, before=()):
    path = HERE / name
    path.unlink(missing_ok=True)
    for data_set in [*before, *functions]:
        # Its mode "overwrite" leaves binary sets without their end.
        pyuff.UFF(str(path)).write_sets(data_set, mode="add")


two = [function(1, tip, "m", 8), function(2, force, "N", 13)]
uff("text.uff", two)
uff("single.uff", [{**f, "ord_data_type": 2} for f in two])
uff("binary.uff", [{**f, "binary": 1} for f in two])
uff("uneven.uff", [{**f, "abscissa_spacing": 0, "x": uneven} for f in two])
uff("uneven_binary.uff", [{**f, "abscissa_spacing": 0, "x": uneven, "binary": 1} for f in two])
units = {"type": 164, "units_code": 1, "units_description": "SI", "temp_mode": 1, "length": 1.0, "force": 1.0, "temp": 1.0, "temp_offset": 273.15}
frf = function(3, tip + 1j * force, "m/N", 8, func_type=4, ord_data_type=6, abscissa_spec_data_type=18)
uff("units_and_spectrum.uff", [function(1, tip, "NONE", 8), frf], before=[units])
uff("spectrum_only.uff", [frf])

wavfile.write(HERE / "pcm16.wav", 8000, np.round(16384 * np.column_stack([np.cos(t), np.sin(t)])).astype(np.int16))
wavfile.write(HERE / "float.wav", 44100, np.cos(t).astype(np.float32))
