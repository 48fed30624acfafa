"""Descriptors by plain loops that follow paper 1 line by line: slow, obvious, for comparison."""

import math

import numpy as np


def slow_hog_cell(image, rows, columns, n_alpha):
    """Section 3.3: weighted votes of the pixels of one cell."""
    height, width = image.shape
    histogram = np.zeros(n_alpha)
    for y in rows:
        for x in columns:
            gx = float(image[y, min(x + 1, width - 1)]) - float(image[y, max(x - 1, 0)])
            gy = float(image[min(y + 1, height - 1), x]) - float(image[max(y - 1, 0), x])
            angle = math.degrees(math.atan2(gy, gx)) % 180
            histogram[min(int(angle / (180 / n_alpha)), n_alpha - 1)] += math.hypot(gx, gy)
    return histogram


def slow_honv_cell(normals, rows, columns, layout):
    """Section 3.4, eq. 2 and 3, of normals turned to the scanner."""
    histogram = np.zeros((layout.n_theta, layout.n_phi))
    for y in rows:
        for x in columns:
            nx, ny, nz = (float(value) for value in normals[y, x])
            if nz < 0:
                theta = math.degrees(math.atan(math.hypot(nx / -nz, ny / -nz)))
                phi = math.degrees(math.atan2(ny, nx)) % layout.phi_range_deg
                i = min(int(theta / (90 / layout.n_theta)), layout.n_theta - 1)
                j = min(int(phi / (layout.phi_range_deg / layout.n_phi)), layout.n_phi - 1)
                histogram[i, j] += 1
    return histogram


def slow_rotation(normal):
    """The smallest rotation of (0, 0, -1) to `normal`, by Rodrigues' formula about their cross product."""
    image_normal = np.array([0.0, 0.0, -1.0])
    axis = np.cross(image_normal, normal)
    sine, cosine = np.linalg.norm(axis), float(image_normal @ normal)
    if sine < 1e-12:
        return np.eye(3)
    x, y, z = axis / sine
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + sine * cross + (1 - cosine) * cross @ cross


def slow_line_bin(edge, layout):
    x, y, z = edge
    if y < -1e-12 or (abs(y) <= 1e-12 and x < 0):
        x, y, z = -x, -y, -z
    phi = math.degrees(math.atan2(max(y, 0.0), x))
    theta = math.degrees(math.acos(max(-1.0, min(1.0, -z))))
    i = min(int(theta / (180 / layout.n_theta) + 1e-9), layout.n_theta - 1)
    j = min(int(phi / (180 / layout.n_phi) + 1e-9), layout.n_phi - 1)
    return i, j


def slow_cells(image, normals, layout):
    """Algorithm 1, steps 1 to 3: HOG, HONV and 3DHOG of every cell."""
    height, width = image.shape
    k = layout.cells
    hog, honv, hog3d = [], [], []
    for cell in range(k * k):
        rows = [y for y in range(height) if y * k // height == cell // k]
        columns = [x for x in range(width) if x * k // width == cell % k]
        grad = slow_hog_cell(image, rows, columns, layout.n_alpha)
        norm = slow_honv_cell(normals, rows, columns, layout)
        voted = np.zeros((layout.n_theta, layout.n_phi))
        for i in range(layout.n_theta):
            for j in range(layout.n_phi):
                theta = math.radians((i + 0.5) * 90 / layout.n_theta)
                phi = math.radians((j + 0.5) * layout.phi_range_deg / layout.n_phi)
                normal = [
                    math.sin(theta) * math.cos(phi),
                    math.sin(theta) * math.sin(phi),
                    -math.cos(theta),
                ]
                a = slow_rotation(np.array(normal))
                for u in range(layout.n_alpha):
                    alpha = math.radians((u + 0.5) * 180 / layout.n_alpha)
                    edge = a @ [math.cos(alpha), math.sin(alpha), 0.0]
                    voted[slow_line_bin(edge, layout)] += grad[u] * norm[i, j]
        hog.append(grad)
        honv.append(norm.ravel())
        hog3d.append(voted.ravel())
    return np.array(hog), np.array(honv), np.array(hog3d)


def slow_blocks(histograms, layout, epsilon):
    """Algorithm 1, step 4: every block of q x q cells scaled to length 1."""
    k, q = layout.cells, layout.block
    grid = histograms.reshape(k, k, -1)
    blocks = [grid[i : i + q, j : j + q].ravel() for i in range(k - q + 1) for j in range(k - q + 1)]
    strongest = max(float(block @ block) for block in blocks)
    parts = []
    for block in blocks:
        length = math.sqrt(float(block @ block) + epsilon**2 * strongest)
        parts.append(block / length if length else block)
    return np.concatenate(parts)
