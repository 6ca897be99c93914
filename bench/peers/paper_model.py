"""The paper's filter as somebody writes it in NumPy: the model of paper_model.hpp, statement by statement."""
import csv
import json
import time

import numpy as np

STATES, MEASURED, STEP_S = 24, 4, 0.125
READOUT_RAD, TRACKER_RAD = 9.7e-6, np.array([1.45e-5, 1.45e-5, 9.7e-5])
COEFFICIENT_RAD_S, ALIGNMENT_RAD = 2e-6, 8.7e-3
DIRECTION, DRIFT, ALIGNMENT = (0, 2), (4, 14), (11, 21)


def read_csv(path):
    with open(path, newline="") as file:
        rows = csv.reader(file)
        next(rows)
        return np.array([[float(value) for value in row] for row in rows])


def read_pass(directory):
    """t_s, and unit directions of both gyros; t_s, and rotations C_in_c."""
    gyro, tracker = read_csv(f"{directory}/gyro.csv"), read_csv(f"{directory}/star_tracker.csv")
    h_b = gyro[:, 1:7].reshape(-1, 2, 3)
    return gyro[:, 0], h_b / np.linalg.norm(h_b, axis=2, keepdims=True), tracker[:, 0], np.array([rotation(q) for q in tracker[:, 1:5]])


def rotation(q):
    x, y, z, w = q / np.linalg.norm(q)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def cross_matrix(v):
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def cross(a, b):  # numpy.cross takes ten times as long for two vectors
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def unit(v):
    return v / np.sqrt(v @ v)


def turn(v):
    angle = np.sqrt(v @ v)
    if angle == 0:
        return np.eye(3)
    k = cross_matrix(v / angle)
    return np.eye(3) + np.sin(angle) * k + 2 * np.sin(angle / 2) ** 2 * (k @ k)


def trihedron(h1, h2):
    q2, q1 = unit(h1), unit(cross(h1, h2))
    return np.column_stack([q1, q2, cross(q1, q2)])


def drift_basis(h):
    s = h * h
    k0 = h * (s @ s - s)
    return np.array([[k0[0], h[0] * s[1], 0, -h[0] * s[2], 0, h[1] * h[2], 0],
                     [k0[1], -h[1] * s[0], h[1] * s[2], 0, 0, 0, h[2] * h[0]],
                     [k0[2], 0, -h[2] * s[1], h[2] * s[0], h[0] * h[1], 0, 0]])


class Model:
    def __init__(self):
        self.h_in, self.kappa, self.C_c_b = [None, None], [np.zeros(7), np.zeros(7)], [np.eye(3), np.eye(3)]

    def rebase(self):
        q = trihedron(*self.h_in)
        normal = cross(*self.h_in)
        cotangent = self.h_in[0] @ self.h_in[1] / np.sqrt(normal @ normal)
        self.components = [q[:, [0, 2]].T, q[:, [0, 1]].T]
        self.tangents = [q[:, [0, 2]], np.column_stack([q[:, 0], q[:, 1] - cotangent * q[:, 2]])]

    def start(self, C_in_c, h_b):
        """The covariance after the first fix."""
        self.h_in = [C_in_c @ (self.C_c_b[k] @ h_b[k]) for k in range(2)]
        self.rebase()
        prior = np.zeros(STATES)
        for k in range(2):
            prior[DRIFT[k]:DRIFT[k] + 7] = COEFFICIENT_RAD_S ** 2
            prior[ALIGNMENT[k]:ALIGNMENT[k] + 3] = ALIGNMENT_RAD ** 2
        P = np.diag(prior)
        _, H, R = self.measure(C_in_c, h_b)
        H[:, :4] = 0
        mixed = -H @ P
        P[:4, :4] = H @ P @ H.T + R
        P[:4, 4:] = mixed[:, 4:]
        P[4:, :4] = mixed[:, 4:].T
        return P

    def step(self, h_b):
        """The transition of the errors over one sample."""
        C_in_c = trihedron(*self.h_in) @ trihedron(self.C_c_b[0] @ h_b[0], self.C_c_b[1] @ h_b[1]).T
        before, tangents, turned, by_drift = self.h_in, self.tangents, [], []
        for k in range(2):
            by_drift.append(STEP_S * C_in_c @ self.C_c_b[k] @ drift_basis(h_b[k]))
            turned.append(by_drift[k] @ self.kappa[k])
        self.h_in = [unit(turn(turned[k]) @ before[k]) for k in range(2)]
        self.rebase()
        F = np.eye(STATES)
        for k in range(2):
            of_turn = -self.components[k] @ cross_matrix(self.h_in[k])
            rows = slice(DIRECTION[k], DIRECTION[k] + 2)
            F[rows, rows] = of_turn @ (np.eye(3) + cross_matrix(turned[k])) @ cross_matrix(before[k]) @ tangents[k]
            F[rows, DRIFT[k]:DRIFT[k] + 7] = of_turn @ by_drift[k]
            F[rows, ALIGNMENT[k]:ALIGNMENT[k] + 3] = -of_turn @ cross_matrix(turned[k]) @ C_in_c
        return F

    def measure(self, C_in_c, h_b):
        """y = H x + noise of covariance R."""
        y, H, noise = np.zeros(MEASURED), np.zeros((MEASURED, STATES)), np.zeros((MEASURED, 9))
        for k in range(2):
            rows = slice(DIRECTION[k], DIRECTION[k] + 2)
            reference = C_in_c @ (self.C_c_b[k] @ h_b[k])
            across = self.components[k] @ cross_matrix(reference)
            y[rows] = self.components[k] @ (reference - self.h_in[k])
            H[rows, rows] = np.eye(2)
            H[rows, ALIGNMENT[k]:ALIGNMENT[k] + 3] = across @ C_in_c
            noise[rows, :3] = across @ C_in_c * TRACKER_RAD
            noise[rows, 3 + 3 * k:6 + 3 * k] = READOUT_RAD * across
        return y, H, noise @ noise.T

    def feed_back(self, x):
        for k in range(2):
            error = self.tangents[k] @ x[DIRECTION[k]:DIRECTION[k] + 2]
            self.h_in[k] = unit(turn(cross(self.h_in[k], error)) @ self.h_in[k])
            self.kappa[k] = self.kappa[k] + x[DRIFT[k]:DRIFT[k] + 7]
            self.C_c_b[k] = turn(x[ALIGNMENT[k]:ALIGNMENT[k] + 3]) @ self.C_c_b[k]


def alignment_vector(C):
    axis = np.array([C[2, 1] - C[1, 2], C[0, 2] - C[2, 0], C[1, 0] - C[0, 1]]) / 2
    sine = np.sqrt(axis @ axis)
    return axis * (np.arctan2(sine, (np.trace(C) - 1) / 2) / sine)


def measure_and_print(name, directory, start, predict, update, covariance):
    """Flies the pass once. start(P), predict(F), update(y, H, R) → correction, covariance()."""
    t, h_b, fix_t, C_in_c = read_pass(directory)
    begin = time.process_time()
    model, fix = Model(), 0
    for i in range(len(t)):
        if fix > 0:
            predict(model.step(h_b[i]))
        if fix < len(fix_t) and fix_t[fix] <= t[i]:
            if fix > 0:
                model.feed_back(update(*model.measure(C_in_c[fix], h_b[i])))
            else:
                start(model.start(C_in_c[fix], h_b[i]))
            fix += 1
    seconds = time.process_time() - begin
    parameters = np.concatenate([np.concatenate([model.kappa[k], alignment_vector(model.C_c_b[k])]) for k in range(2)])
    print(json.dumps({"peer": name, "seconds": seconds, "parameters": parameters.tolist(), "sigmas": np.sqrt(np.diag(covariance())[4:]).tolist()}))
