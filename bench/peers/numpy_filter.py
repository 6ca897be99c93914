"""The paper's filter with a full covariance in NumPy, propagated at each gyro sample: numpy_filter.py PASS."""
import sys

import numpy as np

import paper_model


class Dense:
    def start(self, P):
        self.P = P

    def predict(self, F):
        self.P = F @ self.P @ F.T

    def update(self, y, H, R):
        PHt = self.P @ H.T
        K = np.linalg.solve(H @ PHt + R, PHt.T).T
        P = self.P - K @ PHt.T
        self.P = (P + P.T) / 2
        return K @ y

    def covariance(self):
        return self.P


its = Dense()
paper_model.measure_and_print("NumPy", sys.argv[1], its.start, its.predict, its.update, its.covariance)
