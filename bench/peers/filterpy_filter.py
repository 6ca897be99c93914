"""The paper's filter with the KalmanFilter of filterpy, predicted at each gyro sample: filterpy_filter.py PASS."""
import sys

import numpy as np
from filterpy.kalman import KalmanFilter

import paper_model

its = KalmanFilter(dim_x=paper_model.STATES, dim_z=paper_model.MEASURED)
its.Q = np.zeros((paper_model.STATES, paper_model.STATES))


def start(P):
    its.P = P


def predict(F):
    its.predict(F=F)


def update(y, H, R):
    its.x = np.zeros((paper_model.STATES, 1))  # errors of a model that was fed back
    its.update(y.reshape(-1, 1), R=R, H=H)
    return its.x.ravel()


paper_model.measure_and_print("filterpy", sys.argv[1], start, predict, update, lambda: its.P)
