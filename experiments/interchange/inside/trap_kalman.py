"""pykalman: one masked coordinate of a frame, and what becomes of the other one."""

import json

import numpy as np
from pykalman import KalmanFilter

frames = np.ma.masked_array(np.zeros((21, 2)), mask=False)
frames[10, 0] = 60.0
filter_ = KalmanFilter(
    np.eye(2), np.eye(2), 100 * np.eye(2), 0.01 * np.eye(2), initial_state_mean=np.zeros(2)
)
seen = filter_.smooth(frames)[0][10, 0]
frames[10, 1] = np.ma.masked
print(
    json.dumps(
        {
            "a jump of 60, all seen": seen,
            "the other coordinate masked": filter_.smooth(frames)[0][10, 0],
        }
    )
)
