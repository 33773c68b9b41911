"""A small software renderer: triangles, particles and colliders to a picture, without a screen.

Enters: a frame (a PLY file that `nappe run --save FOLDER` wrote), the colliders of its scene, a camera.
Leaves: an RGB picture. Needs numpy. Lengths are metres; y is up.
"""

import numpy as np

SKY = np.array([0.93, 0.95, 0.97])
GROUND = np.array([0.70, 0.72, 0.75])
SOLID = np.array([0.55, 0.60, 0.66])
CLOTH = [np.array(colour) for colour in ([0.78, 0.27, 0.22], [0.20, 0.45, 0.70])]
FRESH, PACKED, LOOSE = np.array([0.97, 0.98, 1.0]), np.array([0.12, 0.36, 0.80]), np.array([0.95, 0.66, 0.25])
LIGHT = np.array([0.45, 0.85, 0.35])
LIGHT = LIGHT / np.linalg.norm(LIGHT)
AMBIENT = 0.42
NUMBERS = {"float": "<f4", "double": "<f8"}  # of PLY files
FIELD_OF_VIEW = 0.62  # rad, of the picture's height


def read_ply(path):
    """Vertices as a dictionary of columns, and triangles as an array of n x 3."""
    data = path.read_bytes()
    header, body = data.split(b"end_header\n", 1)
    counts, names = {}, []
    for line in header.decode().splitlines():
        words = line.split()
        if words[0] == "element":
            counts[words[1]] = int(words[2])
        elif words[0] == "property" and words[1] in NUMBERS:
            names.append((words[2], NUMBERS[words[1]]))
    vertices = np.frombuffer(body, np.dtype(names), counts["vertex"])
    faces = np.frombuffer(body[vertices.nbytes :], np.dtype([("n", "u1"), ("corners", "<u4", 3)]), counts["face"])
    return {name: vertices[name].astype(float) for name, _ in names}, faces["corners"].astype(int)


class Camera:
    """Looks at a box from a direction, and is as far away as it takes to see all of the box."""

    def __init__(self, low, high, azimuth, elevation, size):
        self.width, self.height = size
        target = (low + high) / 2
        a, e = np.radians([azimuth, elevation])
        back = np.array([np.cos(e) * np.sin(a), np.sin(e), np.cos(e) * np.cos(a)])
        right = np.cross([0.0, 1.0, 0.0], back)
        right /= np.linalg.norm(right)
        self.axes = np.stack([right, np.cross(back, right), back])
        self.scale = self.height / 2 / np.tan(FIELD_OF_VIEW / 2)
        corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
        x, y, z = self.axes @ (corners - target).T
        half = np.array([self.width, self.height]) / 2 / self.scale * 0.9
        distance = max((np.abs(x) / half[0] + z).max(), (np.abs(y) / half[1] + z).max())
        self.eye = target + back * distance

    def project(self, points):
        """Columns, rows (pixels) and depths (m) of points."""
        x, y, z = self.axes @ (points - self.eye).T
        return self.width / 2 + self.scale * x / -z, self.height / 2 - self.scale * y / -z, -z

    def rays(self):
        """Directions of all pixels whose component along the view is 1."""
        columns, rows = np.meshgrid(np.arange(self.width) + 0.5, np.arange(self.height) + 0.5)
        x, y = (columns - self.width / 2) / self.scale, (self.height / 2 - rows) / self.scale
        return x[..., None] * self.axes[0] + y[..., None] * self.axes[1] - self.axes[2]


class Canvas:
    """Colours and depths of pixels."""

    def __init__(self, width, height):
        self.colour = np.tile(SKY, (height, width, 1))
        self.depth = np.full((height, width), np.inf)

    def put(self, rows, columns, depth, colour):
        """Colours a rectangle where it is nearer than what is there."""
        there = self.depth[rows, columns]
        near = depth < there
        self.colour[rows, columns][near] = colour[near] if colour.ndim == 3 else colour
        there[near] = depth[near]

    def triangles(self, x, y, z, faces, colours):
        """Triangles with a colour for each corner."""
        height, width = self.depth.shape
        for corners in faces:
            cx, cy, cz = x[corners], y[corners], z[corners]
            left, right = max(int(cx.min()), 0), min(int(cx.max()) + 2, width)
            top, bottom = max(int(cy.min()), 0), min(int(cy.max()) + 2, height)
            area = (cx[1] - cx[0]) * (cy[2] - cy[0]) - (cx[2] - cx[0]) * (cy[1] - cy[0])
            if left >= right or top >= bottom or abs(area) < 1e-9:
                continue
            px, py = np.meshgrid(np.arange(left, right) + 0.5, np.arange(top, bottom) + 0.5)
            w1 = ((px - cx[0]) * (cy[2] - cy[0]) - (cx[2] - cx[0]) * (py - cy[0])) / area
            w2 = ((cx[1] - cx[0]) * (py - cy[0]) - (px - cx[0]) * (cy[1] - cy[0])) / area
            inside = (w1 >= -1e-3) & (w2 >= -1e-3) & (w1 + w2 <= 1.001)
            depth = np.where(inside, cz[0] + w1 * (cz[1] - cz[0]) + w2 * (cz[2] - cz[0]), np.inf)
            c = colours[corners]
            shade = c[0] + w1[..., None] * (c[1] - c[0]) + w2[..., None] * (c[2] - c[0])
            self.put(slice(top, bottom), slice(left, right), depth, shade)

    def balls(self, x, y, z, pixels, colours, light):
        """Particles as small lit balls of a radius (pixels), one for each particle."""
        height, width = self.depth.shape
        for column, row, depth, radius, colour in zip(x, y, z, pixels, colours):
            left, right = max(int(column - radius), 0), min(int(column + radius) + 2, width)
            top, bottom = max(int(row - radius), 0), min(int(row + radius) + 2, height)
            if left >= right or top >= bottom or depth <= 0:
                continue
            px, py = np.meshgrid(np.arange(left, right) + 0.5, np.arange(top, bottom) + 0.5)
            nx, ny = (px - column) / radius, (row - py) / radius
            outside = nx * nx + ny * ny > 1
            nz = np.sqrt(np.maximum(1 - nx * nx - ny * ny, 0))
            lit = AMBIENT + (1 - AMBIENT) * np.maximum(nx * light[0] + ny * light[1] + nz * light[2], 0)
            self.put(slice(top, bottom), slice(left, right), np.where(outside, np.inf, depth), lit[..., None] * colour)


def distance(collider, p):
    """Signed distance of points from a collider (m), negative inside."""
    if plane := collider.get("plane"):
        normal = np.array(plane["normal"], float)
        return (p - plane["point"]) @ (normal / np.linalg.norm(normal))
    if sphere := collider.get("sphere"):
        return np.linalg.norm(p - sphere["center"], axis=-1) - sphere["radius"]
    if (box := collider.get("box")) and "rotate" not in box:
        q = np.abs(p - box["center"]) - np.array(box["size"]) / 2
        return np.linalg.norm(np.maximum(q, 0), axis=-1) + np.minimum(q.max(axis=-1), 0)
    if capsule := collider.get("capsule"):
        start, along = np.array(capsule["start"], float), np.subtract(capsule["end"], capsule["start"])
        share = np.clip((p - start) @ along / (along @ along), 0, 1)
        return np.linalg.norm(p - start - share[..., None] * along, axis=-1) - capsule["radius"]
    raise ValueError(f"nobody has drawn the collider {collider.get('name')} yet: add its distance to raster.py")


def march(colliders, origin, rays, reach):
    """How far along each ray the nearest collider is, in lengths of the ray; infinite where there is none."""
    length = np.linalg.norm(rays, axis=-1)
    t = np.zeros(rays.shape[:-1])
    hit, alive = np.full(t.shape, -1), np.ones(t.shape, bool)
    for _ in range(160):
        p = origin + t[alive][:, None] * rays[alive]
        each = np.stack([distance(collider, p) for collider in colliders])
        nearest = each.min(axis=0)
        where = np.flatnonzero(alive)
        done = nearest < 1e-4
        hit.flat[where[done]] = each.argmin(axis=0)[done]
        t.flat[where] += np.maximum(nearest, 0) / length.flat[where]
        alive.flat[where[done | (t.flat[where] > reach)]] = False
        if not alive.any():
            break
    return np.where(hit >= 0, t, np.inf), hit


def draw_colliders(canvas, camera, colliders, shadow):
    """Draws solids, and planes seen from their free side, with the shadow of what has been drawn of the scene."""
    rays = camera.rays()
    reach = 12 * np.linalg.norm(camera.eye)
    t, hit = march(colliders, camera.eye, rays, reach)
    seen = hit >= 0
    p = camera.eye + t[seen][:, None] * rays[seen]
    which = hit[seen]
    normal, colour = np.zeros_like(p), np.zeros_like(p)
    step = 1e-4
    for index, collider in enumerate(colliders):
        mine = which == index
        for axis in range(3):
            offset = np.eye(3)[axis] * step
            normal[mine, axis] = (distance(collider, p[mine] + offset) - distance(collider, p[mine] - offset)) / (2 * step)
        colour[mine] = GROUND if "plane" in collider else SOLID
    lit = np.maximum(normal @ LIGHT, 0) * shadow(p)
    far = np.clip(t[seen] / np.linalg.norm(camera.eye) / 6, 0, 1)[:, None]
    shade = colour * (AMBIENT + (1 - AMBIENT) * lit)[:, None]
    image = np.zeros_like(canvas.colour)
    image[seen] = shade * (1 - far) + SKY * far
    canvas.put(slice(None), slice(None), t, image)


def shadow_of(points, faces, loose, radius):
    """A function of points that is 0 where the scene hides the light and 1 elsewhere."""
    side = np.cross(LIGHT, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side)
    axes = np.stack([side, np.cross(LIGHT, side), LIGHT])
    flat = points @ axes.T
    low, high = flat.min(axis=0) - 4 * radius, flat.max(axis=0) + 4 * radius
    scale = 400 / max(high[:2] - low[:2])
    size = np.ceil((high[:2] - low[:2]) * scale).astype(int) + 1
    x, y, z = (flat[:, 0] - low[0]) * scale, (flat[:, 1] - low[1]) * scale, high[2] - flat[:, 2]
    canvas = Canvas(*size)
    canvas.triangles(x, y, z, faces, np.zeros((len(points), 3)))
    dots = np.full(loose.sum(), max(radius * scale, 1.0))
    canvas.balls(x[loose], y[loose], z[loose] + 1e-3, dots, np.zeros((len(dots), 3)), [0, 0, 1])

    def light(p):
        q = p @ axes.T
        column = ((q[:, 0] - low[0]) * scale).astype(int)
        row = ((q[:, 1] - low[1]) * scale).astype(int)
        inside = (column >= 0) & (row >= 0) & (column < size[0]) & (row < size[1])
        hidden = np.zeros(len(p), bool)
        hidden[inside] = canvas.depth[row[inside], column[inside]] < (high[2] - q[inside, 2]) - 2 * radius
        return np.where(hidden, 0.25, 1.0)

    return light


def normals(points, faces):
    """Normals of vertices, of length 1 or 0."""
    n = np.zeros_like(points)
    of_faces = np.cross(points[faces[:, 1]] - points[faces[:, 0]], points[faces[:, 2]] - points[faces[:, 0]])
    for corner in range(3):
        np.add.at(n, faces[:, corner], of_faces)
    length = np.linalg.norm(n, axis=1, keepdims=True)
    return np.divide(n, length, out=np.zeros_like(n), where=length > 0)


def render(frame, colliders, view, size, radius):
    """A picture of a frame: heights x widths x 3, each from 0 to 1. `view` is azimuth and elevation (degrees)."""
    columns, faces = frame
    points = np.stack([columns["x"], columns["y"], columns["z"]], axis=1)
    loose = np.ones(len(points), bool)
    loose[faces.ravel()] = False
    # A few particles that fly off do not make the rest small.
    low, high = np.percentile(points, [0.3, 99.7] if loose.any() else [0, 100], axis=0)
    for collider in colliders:
        if sphere := collider.get("sphere"):
            low = np.minimum(low, np.array(sphere["center"]) - sphere["radius"])
            high = np.maximum(high, np.array(sphere["center"]) + sphere["radius"])
    camera = Camera(low - radius, high + radius, *view, size)
    canvas = Canvas(*size)

    towards = normals(points, faces)
    facing = np.sign(np.sum(towards * (camera.eye - points), axis=1))[:, None]
    lit = AMBIENT + (1 - AMBIENT) * np.maximum((towards * facing) @ LIGHT, 0)
    x, y, z = camera.project(points)
    canvas.triangles(x, y, z, faces, lit[:, None] * CLOTH[0])

    ratio = columns.get("plastic_ratio", np.ones(len(points)))[loose]
    packed, open_ = np.clip((1 - ratio) / 0.25, 0, 1)[:, None], np.clip((ratio - 1) / 0.5, 0, 1)[:, None]
    snow = FRESH + packed * (PACKED - FRESH) + open_ * (LOOSE - FRESH)
    pixels = np.maximum(radius * camera.scale / z[loose], 0.8)
    canvas.balls(x[loose], y[loose], z[loose] - radius, pixels, snow, camera.axes @ LIGHT)

    seen = [c for c in colliders if "plane" not in c or distance(c, camera.eye) > 0 and np.array(c["plane"]["normal"])[1] > 0.5]
    if seen:
        draw_colliders(canvas, camera, seen, shadow_of(points, faces, loose, radius))
    return np.clip(canvas.colour, 0, 1)
