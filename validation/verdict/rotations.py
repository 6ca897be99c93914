"""Rotations as the pass files have them: unit quaternions (x, y, z, w), Hamilton, scalar last; rotation vectors in rad."""
import math


def exponential(vector):
    angle = math.sqrt(sum(x * x for x in vector))
    factor = math.sin(angle / 2) / angle if angle > 1e-12 else 0.5
    return (vector[0] * factor, vector[1] * factor, vector[2] * factor, math.cos(angle / 2))


def logarithm(q):
    """The shortest rotation vector."""
    sine = math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2])
    angle = 2 * math.atan2(sine, abs(q[3]))
    factor = math.copysign(angle / sine if sine > 1e-15 else 2.0, q[3])
    return (q[0] * factor, q[1] * factor, q[2] * factor)


def product(a, b):
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz)


def inverse(q):
    return (-q[0], -q[1], -q[2], q[3])


def rotated(q, v):
    """q v q*"""
    return product(product(q, (*v, 0.0)), inverse(q))[:3]
