#!/usr/bin/python3
"""Training pairs: two pictures, corners of both, and which of them are the same point.

A cache of a scene (`data.py WORK SCENE FOLDER:SEQUENCE...`, called by render.sh) is
  SCENE_images.npy  uint8 (n, 480, 640, 3), blue green red
  SCENE_depths.npy  uint16 (n, 480, 640), half millimetres along the optical axis; 0: nothing there
  SCENE.npz         poses (n, 3, 4) camera to world, metres, z forward; cameras (n, 4) fx fy cx cy;
                    pairs (p, 5): frames i and j, share of i that j sees, median angle in degrees
                    between the two rays to a point, median of (distance to i / distance to j);
                    corners (c, 2) int16, those of frame i in rows first[i] to first[i + 1]
A pair for training is (a, b, pa, pb, ta, tb, m): pictures uint8 (192, 256); corners float32 (k, 2) in
pixels, k <= 300, of which the first m of both are the same points; where the corners of a lie in b
(tb) and those of b in a (ta), -1000 if nowhere.
"""
import glob
import os
import sys

import cv2
import numpy as np
from scipy.ndimage import map_coordinates

H, W = 192, 256
POINTS = 300                        # corners of a picture at most
MILD = .35                          # how much light and camera do to a mild pair
SAME, NOWHERE = 2.0, -1000          # pixels within which two corners are one; a place that is not
BINS = [0, 12, 25, 40, 55, 76]      # degrees between the two views of a pair,
SHARES = [.13, .24, .26, .22, .15]  # and how often each bin is drawn
cv2.setNumThreads(1)

_fast = [cv2.FastFeatureDetector_create(t) for t in (20, 12, 8)]


class Scene:
    """All frames of one world: the sequences about a desk, or two days of a flat."""

    def __init__(self, work, name):
        base = os.path.join(work, 'cache', name)
        self.images = np.load(base + '_images.npy', mmap_mode='r')
        self.depths = np.load(base + '_depths.npy', mmap_mode='r')
        z = np.load(base + '.npz')
        self.T, self.K, self.pairs, self.corners, self.first = (z[k] for k in ('poses', 'cameras', 'pairs', 'corners', 'first'))
        self.bins = [np.flatnonzero((self.pairs[:, 3] >= a) & (self.pairs[:, 3] < b)) for a, b in zip(BINS, BINS[1:])]

    def world(self, i, xy):
        """pixels (n, 2) of frame i -> world (n, 3), valid (n,). At an edge the nearer side counts."""
        return to_world(self.depths[i], self.T[i], self.K[i], xy)

    def project(self, j, X):
        """world (n, 3) -> pixels (n, 2) of frame j, seen there (n,)"""
        return to_pixels(self.depths[j], self.T[j], self.K[j], X)


def around(depth, xy):
    """metres (n, 9) at a pixel and its neighbours; 1000 where nothing is"""
    u = np.clip(np.round(xy), 1, [depth.shape[1] - 2, depth.shape[0] - 2]).astype(int)
    z = np.stack([depth[u[:, 1] + b, u[:, 0] + a] for a in (-1, 0, 1) for b in (-1, 0, 1)], 1).astype(np.float32) / 2000
    z[z == 0] = 1000
    return z


def to_world(depth, T, K, xy):
    z = around(depth, xy).min(1)
    c = np.column_stack([(xy - K[2:]) / K[:2], np.ones(len(xy))]) * z[:, None]
    return c @ T[:, :3].T + T[:, 3], z < 100


def to_pixels(depth, T, K, X):
    c = (X - T[:, 3]) @ T[:, :3]
    z = np.maximum(c[:, 2], 1e-3)
    xy = c[:, :2] / z[:, None] * K[:2] + K[2:]
    h, w = depth.shape
    ok = (c[:, 2] > .1) & (xy > 2).all(1) & (xy[:, 0] < w - 3) & (xy[:, 1] < h - 3)
    d = around(depth, xy)
    ok &= (np.abs(d - z[:, None]) < .015 * z[:, None] + .004).any(1)
    ok &= d.min(1) > .97 * z - .01      # nothing in front within a pixel
    return xy, ok


# ---- the cache of a scene

def make_cache(work, name, parts):
    images, depths, T, K = [], [], [], []
    for part in parts:
        folder, sequence = part.split(':')
        rows = open(os.path.join(work, 'build', folder, f'poses_{sequence}.txt')).read().split('\n')
        poses = np.array([r.split() for r in rows[1:] if r.strip()], float).reshape(-1, 3, 4)
        for f in sorted(glob.glob(os.path.join(work, 'raw', f'{folder}_{sequence}', '*.ppm'))):
            if not os.path.exists(f[:-3] + 'dep'):
                continue
            images.append(cv2.imread(f))
            depths.append(np.fromfile(f[:-3] + 'dep', np.uint16).reshape(480, 640))
            T.append(poses[int(os.path.basename(f)[:6])])
            K.append([float(v) for v in rows[0].split()[:4]])
    images, depths, T, K = np.array(images), np.array(depths), np.array(T), np.array(K)
    base = os.path.join(work, 'cache', name)
    for kind, values in (('images', images), ('depths', depths)):      # a training may have the old file open
        np.save(f'{base}_{kind}_new.npy', values)
        os.replace(f'{base}_{kind}_new.npy', f'{base}_{kind}.npy')
    corners = [clean_corners(im) for im in images]
    pairs = find_pairs(depths, T, K)
    np.savez(base + '_new.npz', poses=T, cameras=K, pairs=pairs, corners=np.concatenate(corners),
             first=np.r_[0, np.cumsum([len(c) for c in corners])])
    os.replace(base + '_new.npz', base + '.npz')
    print(name, len(images), 'frames,', len(pairs), 'pairs, by angle', np.histogram(pairs[:, 3], BINS)[0], flush=True)


def clean_corners(image, most=600):
    """The strongest corners of every cell of 64 pixels: (n, 2) int16"""
    k = cv2.FastFeatureDetector_create(10).detect(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY))
    xy = np.array([p.pt for p in k], np.int16).reshape(-1, 2)
    order = np.argsort([-p.response for p in k], kind='stable') if k else []
    xy = xy[order]
    cell = xy[:, 1] // 64 * 10 + xy[:, 0] // 64
    keep = np.concatenate([np.flatnonzero(cell == c)[:20] for c in range(80)]) if len(xy) else []
    return xy[np.sort(keep).astype(int)][:most]


def find_pairs(depths, T, K):
    """Each pair of frames that see enough of the same, once: (p, 5) float32 as in the cache"""
    n, out = len(T), []
    grid = np.stack(np.meshgrid(np.linspace(20, 620, 14), np.linspace(20, 460, 11)), -1).reshape(-1, 2)
    R, C = T[:, :, :3], T[:, :, 3]
    for i in range(n - 1):
        X, valid = to_world(depths[i], T[i], K[i], grid)
        if valid.sum() < 20:
            continue
        X = X[valid]
        c = np.einsum('nkj,nji->nki', X[None] - C[i + 1:, None], R[i + 1:])
        z = np.maximum(c[..., 2], 1e-3)
        inside = (c[..., 2] > .1) & (np.abs(c[..., 0] / z) < .6) & (np.abs(c[..., 1] / z) < .45)
        a = X - C[i]
        da = np.linalg.norm(a, axis=1)
        for j in np.flatnonzero(inside.mean(1) > .15) + i + 1:
            _, ok = to_pixels(depths[j], T[j], K[j], X)
            if ok.mean() < .13:
                continue
            b = X[ok] - C[j]
            db = np.linalg.norm(b, axis=1)
            angle = np.degrees(np.median(np.arccos(np.clip((a[ok] * b).sum(1) / da[ok] / db, -1, 1))))
            ratio = np.median(da[ok] / db)
            if angle < BINS[-1] and 1 / 2.8 < ratio < 2.8:
                out.append((i, j, ok.mean(), angle, ratio))
    return np.array(out, np.float32).reshape(-1, 5)


# ---- what cameras and light do to a picture

def field(rng, deviation, h=H, w=W):
    """a smooth random field float32 (h, w)"""
    return cv2.resize(rng.normal(0, deviation, (3, 4)).astype(np.float32), (w, h), interpolation=cv2.INTER_CUBIC)


def motion(rng, g, longest):
    n = int(rng.integers(3, longest + 1))
    k, a, c = np.zeros((n, n), np.float32), rng.uniform(0, np.pi), (n - 1) / 2
    for t in np.linspace(-c, c, 3 * n):
        k[int(round(c + t * np.sin(a))), int(round(c + t * np.cos(a)))] = 1
    return cv2.filter2D(g, -1, k / k.sum())


def photograph(rng, g, k=1.0):
    """float32 (h, w), 0 to 1 -> uint8: as a camera takes it on some day; k: how much light and camera do, 1 is all"""
    h, w = g.shape
    g = np.clip(g, 0, 1) ** 2.2                       # linear light
    if rng.random() < .5:                             # other lamps
        g = g * np.exp(field(rng, .6 * k, h, w))
    if rng.random() < .15 * k:                        # the edge of a shadow
        a = rng.uniform(0, 2 * np.pi)
        yy, xx = np.mgrid[0:h, 0:w].astype(np.float32)
        s = ((xx - rng.uniform(0, w)) * np.cos(a) + (yy - rng.uniform(0, h)) * np.sin(a)) / rng.uniform(1, 12)
        g = g * (1 - rng.uniform(.3, .85) / (1 + np.exp(-np.clip(s, -30, 30)))).astype(np.float32)
    if rng.random() < .3:                             # vignetting, of which the picture is a part
        x, y = rng.uniform(-.6, 1.6, 2)
        yy, xx = np.mgrid[0:h, 0:w].astype(np.float32)
        g = g / (1 + rng.uniform(.1, .7) * ((xx / w - x) ** 2 + (yy / h - y) ** 2)) ** 2
    bright = float(np.percentile(g[::4, ::4], 90)) + 1e-3
    if rng.random() < .6 * k:                         # exposure; what is above 1 is saturated
        g = g * (np.exp(rng.normal(-.1, .6)) * .6 / bright)
    else:
        g = g * np.exp(rng.normal(0, .3 * k))
    if rng.random() < .15 * k:                        # glow about lamps and windows
        g = g + rng.uniform(.05, .3) * cv2.GaussianBlur(np.maximum(g - .7, 0), (0, 0), rng.uniform(3, 15))
    if rng.random() < .1 * k:                         # haze, dirty lens
        g = g * .9 + rng.uniform(.01, .08)
    blurred = rng.random() / k
    if blurred < .35:
        g = cv2.GaussianBlur(g, (0, 0), rng.uniform(.3, 1.2))
    elif blurred < .5:                                # resized on the way
        s = rng.uniform(.5, .9)
        g = cv2.resize(cv2.resize(g, None, fx=s, fy=s, interpolation=cv2.INTER_AREA), (w, h), interpolation=cv2.INTER_LINEAR)
    if rng.random() < .2 * k:
        g = motion(rng, g, 9)
    g = np.clip(g, 0, 1)
    if rng.random() < .85:                            # shot and read noise; neighbours correlate by demosaicing
        noise = rng.standard_normal((h, w), dtype=np.float32)
        if rng.random() < .6:
            noise = cv2.GaussianBlur(noise, (0, 0), rng.uniform(.4, .9)) * 1.5
        strength = np.exp(rng.uniform(np.log(5e-5), np.log(2e-3))) * k * k
        g = np.clip(g + noise * np.sqrt(g * strength + strength * .01), 0, 1)
    g = g ** (np.exp(rng.normal(0, .2)) / 2.2)        # the tone curve
    if rng.random() < .3:
        s = rng.uniform(0, 1)                         # more contrast in the middle
        g = g + s * .5 * (g * g * (3 - 2 * g) - g)
    phone = rng.random() / k
    if phone < .15:                                   # a phone's denoising and sharpening
        g = cv2.bilateralFilter(g, 5, .05, 1.5)
    if phone < .3:
        g = g + rng.uniform(.3, 1.4) * (g - cv2.GaussianBlur(g, (0, 0), rng.uniform(.7, 2)))
    g = np.clip(g * 255 + .5, 0, 255).astype(np.uint8)
    if rng.random() < .5:
        g = cv2.imdecode(cv2.imencode('.jpg', g, [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(30, 95))])[1], 0)
    return g


class Paint:
    """A pattern in space, printed on whatever is there: textures that the scenes lack, the same from every side."""

    def __init__(self, rng, cell):
        """cell: metres in which the pattern changes"""
        self.noise = rng.standard_normal((16, 16, 16)).astype(np.float32)
        q = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        self.A, self.b = q / cell, rng.uniform(0, 16, 3)
        self.kind, self.strength = rng.choice(['soft', 'spots', 'weave']), rng.uniform(.2, .8)
        self.level, self.sharp = rng.normal(.2, .5), rng.uniform(3, 15)

    def __call__(self, X):
        """world (n, 3) -> factor (n,)"""
        x = X @ self.A.T + self.b
        if self.kind == 'weave':
            v = np.sin(3 * x[:, 0]) * np.sin(3 * x[:, 1] + .5 * np.sin(x[:, 2])) * 1.5
        else:
            v = map_coordinates(self.noise, x.T, order=1, mode='grid-wrap') * 1.6
        if self.kind == 'spots':
            v = np.tanh(self.sharp * (v - self.level))
        return np.exp(self.strength * np.clip(v, -1.5, 1.5)).astype(np.float32)


def occlude(rng, g, other):
    """Something thin or large in front, with the look of another picture: g changed, mask (h, w) bool"""
    h, w = g.shape
    mask = np.zeros((h, w), np.uint8)
    c = rng.uniform([0, 0], [w, h])
    if rng.random() < .5:        # a rod, a cable
        d = rng.normal(size=2)
        d *= 300 / np.linalg.norm(d)
        cv2.line(mask, *(tuple(int(v) for v in p) for p in (c - d, c + d * rng.uniform(0, 1))), 1, int(rng.integers(2, 14)))
    else:
        a = np.sort(rng.uniform(0, 2 * np.pi, int(rng.integers(4, 9))))
        p = c + np.stack([np.cos(a), np.sin(a)], 1) * rng.uniform(12, 70, (len(a), 1))
        cv2.fillPoly(mask, [p.astype(np.int32)], 1)
    y, x = rng.integers(0, other.shape[0] - h), rng.integers(0, other.shape[1] - w)
    front = cv2.cvtColor(np.ascontiguousarray(other[y:y + h, x:x + w]), cv2.COLOR_BGR2GRAY).astype(np.float32) / 255
    edge = cv2.GaussianBlur(mask.astype(np.float32), (3, 3), .6)
    return g * (1 - edge) + front * rng.uniform(.4, 1.3) * edge, cv2.dilate(mask, np.ones((5, 5), np.uint8)) > 0


def gray(rng, bgr):
    """uint8 (h, w, 3) -> float32 (h, w), 0 to 1; now and then by another sensor's colours"""
    weights = rng.dirichlet([2, 5, 4]) if rng.random() < .4 else np.array([.114, .587, .299])
    return bgr.astype(np.float32) @ (weights / 255).astype(np.float32)


# ---- pairs

def find_corners(rng, g, most=500):
    for f in _fast:
        k = f.detect(g)
        if len(k) >= 120:
            break
    if not k:
        return np.zeros((0, 2), np.float32)
    xy = np.array([p.pt for p in k], np.float32)
    xy = xy[np.argsort(-np.array([p.response for p in k]) * rng.uniform(.5, 1, len(k)))]
    return xy[inside(xy, 4)][:most]


def inside(xy, margin):
    return ((xy > margin) & (xy < [W - 1 - margin, H - 1 - margin])).all(1)


def at(mask, xy):
    u = np.clip(np.round(xy), 0, [W - 1, H - 1]).astype(int)
    return mask[u[:, 1], u[:, 0]]


def join(rng, a, b, a_to_b, b_to_a, mask_a, mask_b):
    """Corners of both pictures and which are the same; None if they are too few. a_to_b: (n, 2) -> (n, 2), seen (n,)"""
    ka, kb = find_corners(rng, a), find_corners(rng, b)
    if len(ka) < 40 or len(kb) < 40:
        return None
    p, seen = a_to_b(ka)
    seen &= inside(p, 4) & ~at(mask_a, ka) & ~at(mask_b, p)
    ia = np.flatnonzero(seen)
    if len(ia) < 25:
        return None
    d2 = ((p[ia][:, None] - kb[None]) ** 2).sum(2)
    j = d2.argmin(1)
    d = np.sqrt(d2[np.arange(len(ia)), j])
    both = np.flatnonzero((d < SAME) & (d2.argmin(0)[j] == np.arange(len(ia))))
    if len(both) < 25 or len(both) < .12 * len(ia):      # noise, not corners
        return None
    # a few that are corners in one picture only
    one = rng.permutation(np.flatnonzero(d > SAME))[:min(60, len(both) // 2)]
    both = rng.permutation(both)[:POINTS - 120]
    pa = np.concatenate([ka[ia[both]], ka[ia[one]]])
    pb = np.concatenate([kb[j[both]], p[ia[one]] + rng.normal(0, .5, (len(one), 2))])
    m = len(pa)
    pa = np.concatenate([pa, ka[rng.permutation(np.setdiff1d(np.arange(len(ka)), ia[np.r_[both, one]]))[:POINTS - m]]])
    pb = np.concatenate([pb, kb[rng.permutation(np.setdiff1d(np.arange(len(kb)), j[both]))[:POINTS - m]]])
    tb, seen_a = a_to_b(pa)
    ta, seen_b = b_to_a(pb)
    tb[~seen_a], ta[~seen_b] = NOWHERE, NOWHERE
    return pa, pb, ta, tb, m


def turns(rng):
    """Degrees by which both are turned, and the second against the first. Quarter turns of both: more looks of one scene."""
    both = rng.normal(0, 8) + (90 * rng.integers(1, 4) if rng.random() < .12 else 0)
    return both, rng.uniform(-20, 20) if rng.random() < .5 else rng.normal(0, 6)


def similarity(centre, scale, angle, to, mirror):
    """(2, 3): pixels of a frame -> pixels of a picture"""
    a = np.deg2rad(angle)
    A = scale * np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]) @ np.diag([-1 if mirror else 1, 1])
    return np.column_stack([A, to - A @ centre])


def apply(M, xy):
    return xy @ M[:, :2].T + M[:, 2]


def cut(image, M, flags=cv2.INTER_LINEAR):
    s = np.sqrt(abs(np.linalg.det(M[:, :2])))
    if s < .8 and flags == cv2.INTER_LINEAR:
        # only what is needed is blurred
        c = apply(cv2.invertAffineTransform(M), np.array([[0, 0], [W, 0], [W, H], [0, H]], float))
        x0, y0 = np.clip(c.min(0) - 6, 0, [630, 470]).astype(int)
        x1, y1 = np.clip(c.max(0) + 6, [x0 + 4, y0 + 4], [640, 480]).astype(int)
        image = cv2.GaussianBlur(image[y0:y1, x0:x1], (0, 0), .5 * np.sqrt(1 / s ** 2 - 1) + .05)
        M = np.column_stack([M[:, :2], M[:, 2] + M[:, :2] @ [x0, y0]])
    return cv2.warpAffine(image, M, (W, H), flags=flags, borderMode=cv2.BORDER_REFLECT_101)


def rendered_pair(rng, s, k=1.0):
    """Two frames of a scene; None where they show too little of the same. k: as in `photograph`"""
    b = s.bins[rng.choice(len(s.bins), p=SHARES)]
    if not len(b):
        return None
    i, j, _, _, ratio = s.pairs[rng.choice(b)]
    i, j = int(i), int(j)
    if rng.random() < .5:
        i, j, ratio = j, i, 1 / ratio
    c = s.corners[s.first[i]:s.first[i + 1]]
    if len(c) < 40:
        return None
    c = c[rng.permutation(len(c))[:200]].astype(float)
    X, valid = s.world(i, c)
    q, ok = s.project(j, X)
    ok = np.flatnonzero(ok & valid)
    if len(ok) < 12:
        return None
    # ORB's levels even out a part of the ratio
    rest = np.exp(rng.normal(0, .22))
    e = np.clip(ratio / rest, .45, 2.2) ** .5 if rng.random() < .8 else 1
    base = np.exp(rng.uniform(np.log(.42), np.log(1.3))) / max(e, 1 / e) ** .5
    both, second = turns(rng)
    mirror = rng.random() < .5
    for _ in range(4):
        mid = rng.choice(ok)
        to = np.array([W / 2, H / 2]) + rng.uniform(-.15, .15, 2) * [W, H]
        MA = similarity(c[mid], base * e, both, to, mirror)
        MB = similarity(q[mid], base / e, both + second, to + rng.uniform(-.1, .1, 2) * [W, H], mirror)
        if (inside(apply(MA, c[ok]), 4) & inside(apply(MB, q[ok]), 4)).sum() >= max(8, .12 * len(c)):
            break
    else:
        return None
    IA, IB = cv2.invertAffineTransform(MA), cv2.invertAffineTransform(MB)
    a, b = gray(rng, cut(s.images[i], MA)), gray(rng, cut(s.images[j], MB))
    if rng.random() < .3:
        z = np.linalg.norm(X[mid] - s.T[i][:, 3])
        paint = Paint(rng, np.exp(rng.uniform(np.log(4), np.log(40))) * z / (s.K[i][0] * base * e))
        a, b = a * painted(s, i, MA, IA, paint), b * painted(s, j, MB, IB, paint)
    (a, mask_a), (b, mask_b) = (occlude(rng, g, s.images[rng.integers(len(s.images))]) if rng.random() < .15 else
                                (g, np.zeros((H, W), bool)) for g in (a, b))
    a, b = photograph(rng, a, k), photograph(rng, b, k)

    def go(xy, I, i, j, M):
        p = apply(I, xy)
        X, valid = s.world(i, p)
        q, seen = s.project(j, X)
        return apply(M, q), valid & seen & ((p > 2) & (p < [637, 477])).all(1)
    r = join(rng, a, b, lambda xy: go(xy, IA, i, j, MB), lambda xy: go(xy, IB, j, i, MA), mask_a, mask_b)
    return r and (a, b, *r)


def painted(s, i, M, I, paint):
    """factor (H, W) of a pattern in space, as the picture M of frame i shows it"""
    z = cut(s.depths[i], M, cv2.INTER_NEAREST).astype(np.float32).ravel() / 2000
    yy, xx = np.mgrid[0:H, 0:W]
    p = apply(I, np.stack([xx.ravel(), yy.ravel()], 1).astype(np.float32))
    X = np.column_stack([(p - s.K[i][2:]) / s.K[i][:2], np.ones(len(p))]) * z[:, None]
    f = np.where(z > 0, paint(X @ s.T[i][:, :3].T + s.T[i][:, 3]), 1).reshape(H, W)
    return cv2.GaussianBlur(f.astype(np.float32), (3, 3), .5)


def plane_pair(rng, image, other, k=1.0):
    """Two oblique views of a frame as if it were a print; k: as in `photograph`"""
    h, w = image.shape[:2]
    mirror = np.diag([-1. if rng.random() < .5 else 1., 1, 1])

    def view(c, size, turn, tilt):
        f, a = 1.0 * W, rng.uniform(0, 2 * np.pi)
        R = cv2.Rodrigues(np.deg2rad(tilt) * np.array([np.cos(a), np.sin(a), 0]))[0] @ cv2.Rodrigues(np.array([0, 0, np.deg2rad(turn)]))[0] @ mirror
        K = np.array([[f, 0, W / 2 + rng.uniform(-.1, .1) * W], [0, f, H / 2 + rng.uniform(-.1, .1) * H], [0, 0, 1]])
        s = W / size
        return K @ np.column_stack([R[:, 0], R[:, 1], [0, 0, 1.]]) @ np.array([[s / f, 0, -c[0] * s / f], [0, s / f, -c[1] * s / f], [0, 0, 1]])
    size = min(W * np.exp(rng.uniform(np.log(.75), np.log(2.2))), .9 * h)
    c = rng.uniform([w * .25, h * .25], [w * .75, h * .75])
    e = rng.normal(0, .12)
    both, second = turns(rng)
    A = view(c, size * np.exp(e), both, rng.uniform(0, 50))
    B = view(c + rng.normal(0, .05, 2) * size, size * np.exp(-e), both + second, rng.uniform(0, 50))
    if size > 1.3 * W:
        image = cv2.GaussianBlur(image, (0, 0), .35 * size / W)
    if rng.random() < .5:
        image = image[:, :, rng.permutation(3)]
    a, b = (gray(rng, cv2.warpPerspective(image, M, (W, H), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT_101)) for M in (A, B))
    (a, mask_a), (b, mask_b) = (occlude(rng, g, other) if rng.random() < .25 else (g, np.zeros((H, W), bool)) for g in (a, b))
    a, b = photograph(rng, a, k), photograph(rng, b, k)
    AB = B @ np.linalg.inv(A)

    def go(xy, M):
        q = np.column_stack([xy, np.ones(len(xy))]) @ M.T
        return q[:, :2] / q[:, 2:], q[:, 2] > .05
    r = join(rng, a, b, lambda xy: go(xy, AB), lambda xy: go(xy, np.linalg.inv(AB)), mask_a, mask_b)
    return r and (a, b, *r)


def random_pair(rng, scenes, weights, planes=.25, mild=0.):
    """A pair of any kind, or None; planes: the share of planes; mild: that of pairs of one day and a good camera"""
    k = MILD if rng.random() < mild else 1.
    s = scenes[rng.choice(len(scenes), p=weights)]
    if rng.random() < planes:
        i, j = rng.integers(len(s.images), size=2)
        return plane_pair(rng, np.ascontiguousarray(s.images[i]), s.images[j], k)
    return rendered_pair(rng, s, k)


def pack(pair):
    """-> normalised pictures float32 (1, H, W) twice, pa, pb, ta, tb (POINTS, 2), [m, corners of a, of b]"""
    from net import normalise
    a, b, pa, pb, ta, tb, m = pair

    def fill(x, value=0):
        out = np.full((POINTS, 2), value, np.float32)
        out[:len(x)] = x
        return out
    return normalise(a)[None], normalise(b)[None], fill(pa), fill(pb), fill(ta, NOWHERE), fill(tb, NOWHERE), np.array([m, len(pa), len(pb)])


if __name__ == '__main__':
    make_cache(sys.argv[1], sys.argv[2], sys.argv[3:])
