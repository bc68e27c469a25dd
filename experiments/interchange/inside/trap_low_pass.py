"""What a low-pass of 6 Hz leaves of a motion of 6 Hz, in packages for biomechanics."""

import json

import biosppy.signals.tools
import kineticstoolkit.lab as ktk
import numpy as np
import pyomeca

FPS = 100
time = np.arange(0, 10, 1 / FPS)
wave = np.sin(2 * np.pi * 6 * time)
left = {}
series = ktk.TimeSeries(time=time, data={"wave": wave})
left["kineticstoolkit"] = ktk.filters.butter(series, fc=6, order=2).data["wave"]
array = pyomeca.Analogs(wave[None], time=time)
left["pyomeca"] = array.meca.low_pass(freq=FPS, order=2, cutoff=6).values[0]
left["biosppy"] = biosppy.signals.tools.filter_signal(
    wave, ftype="butter", band="lowpass", order=2, frequency=6, sampling_rate=FPS
)["signal"]
print(json.dumps({name: float(np.ptp(kept[300:700])) / 2 for name, kept in left.items()}))
