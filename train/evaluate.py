#!/usr/bin/python3
"""True matches by viewing angle, on real images:  evaluate.py --sequences FOLDER [WEIGHTS...] [--octaves 3 1]

In FOLDER are fr3_office_200 and redkitchen: rgb.txt, groundtruth.txt, camera.yaml. --rendered adds the
sample's loop, and pairs of flat31_walk_a by day and flat31_walk_b in the evening. A table of ORB,
upright RootSIFT and the networks at the same corners: about 1000 of ORB's pyramid (1.2, 8 levels), spread
over the picture, at most one within 4 pixels of a level.

Matches are mutual nearest neighbours. True: within 2 pixels (redkitchen, whose poses are another
camera's, 3) of the true epipolar line in both pictures; what chance gives is taken off: with I of N
matches near the line, of all pairs of corners a share of p, it is (I - p N) / (1 - p). Angle and
overlap of two pictures are those of points that SIFT sees in neighbours and true poses place.
"""
import argparse
import functools
import os

import cv2
import numpy as np
from scipy.spatial.transform import Rotation, Slerp

SEQUENCES = {'fr3_office_200': dict(every=8, pixels=2.0, short='fr3'), 'redkitchen': dict(every=20, pixels=3.0, short='kitchen')}
LOOP = os.path.join(os.path.dirname(os.path.abspath(__file__)), '../data/sample/loop')
RENDERED = {'sample': dict(every=10, pixels=2.0, folders=[LOOP], short='sample'),
            'flat, day and evening': dict(every=20, pixels=2.0, folders=['flat31_walk_a', 'flat31_walk_b'], short='flat')}
BINS = [0, 15, 30, 45, 70]
OVERLAP = .3       # of the points of each picture that are in the other
MOST = 40          # pairs of a bin
SIFT_SIZE = 5      # diameter of a corner of level 0: the best of 5, 7, 9 and 12 on fr3; alike on redkitchen


def read_sequence(folder):
    """-> pictures (`gray`), poses (n, 4, 4) camera to world at their times, (fx, fy, cx, cy)"""
    table = lambda f: [r.split() for r in open(os.path.join(folder, f)) if r.strip() and r[0] != '#']
    truth = np.array(table('groundtruth.txt'), float)
    turn, paths, poses = Slerp(truth[:, 0], Rotation.from_quat(truth[:, 4:8])), [], []
    video = os.path.join(folder, 'video.mp4')
    rows = [(t, (video, n)) for n, t in enumerate(truth[:, 0])] if os.path.exists(video) else [(t, os.path.join(folder, path)) for t, path in table('rgb.txt')]
    for t, path in rows:
        t = np.clip(float(t), truth[0, 0], truth[-1, 0])
        T = np.eye(4)
        T[:3, :3] = turn(t).as_matrix()
        T[:3, 3] = [np.interp(t, truth[:, 0], truth[:, c]) for c in (1, 2, 3)]
        paths.append(path)
        poses.append(T)
    rows = open(os.path.join(folder, 'camera.yaml')).read().split('data: [')[1].split(']')[0]
    k = [float(v) for v in rows.split(',')]
    return paths, np.array(poses), (k[0], k[4], k[2], k[5])


captured = functools.lru_cache(cv2.VideoCapture)


def gray(path):
    """A picture: a file, or (video, number)"""
    if isinstance(path, str):
        return cv2.imread(path, 0)
    video, n = path
    captured(video).set(cv2.CAP_PROP_POS_FRAMES, n)
    return cv2.cvtColor(captured(video).read()[1], cv2.COLOR_BGR2GRAY)


def corners(gray, count=1000):
    """ORB's corners, spread: [cv2.KeyPoint]. The strongest of each cell of its level first, then the next of each..."""
    kps = cv2.ORB_create(6000, 1.2, 8, fastThreshold=8).detect(gray)
    levels = [[] for _ in range(8)]
    for k in kps:
        levels[k.octave].append(k)
    share = np.array([1.2 ** -(2 * l) for l in range(8)])
    wanted = np.round(count * share ** .5 / (share ** .5).sum()).astype(int)
    out, short = [], 0
    for l in range(7, -1, -1):
        s, cells, taken = 1.2 ** l, {}, set()
        for k in sorted(levels[l], key=lambda k: -k.response):
            near = (int(k.pt[0] / s / 4), int(k.pt[1] / s / 4))
            if near not in taken:
                taken.add(near)
                cells.setdefault((int(k.pt[0] / s / 32), int(k.pt[1] / s / 32)), []).append(k)
        order = sorted(((n, -k.response, i, k) for i, c in enumerate(cells.values()) for n, k in enumerate(c)), key=lambda t: t[:3])
        take = [t[3] for t in order[:wanted[l] + short]]
        short = wanted[l] + short - len(take)
        out += take
    return out[::-1]


def orb(gray, kps):
    """-> the corners that it describes, uint8 (n, 32)"""
    kps, d = cv2.ORB_create(6000, 1.2, 8, fastThreshold=8).compute(gray, kps)
    return list(kps), d


def root_sift(gray, kps, size=SIFT_SIZE):
    """Upright, float32 (n, 128)"""
    mine = []
    for k in kps:
        octave = int(np.floor(np.log2(1.2 ** k.octave) + 1e-6))
        layer = 1 + int(3 * (np.log2(1.2 ** k.octave) - octave) + .5)
        mine.append(cv2.KeyPoint(k.pt[0], k.pt[1], size * 1.2 ** k.octave, 0, 1, octave | layer << 8))
    mine, d = cv2.SIFT_create().compute(gray, mine)
    assert len(mine) == len(kps)
    return np.sqrt(d / np.maximum(d.sum(1, keepdims=True), 1))


def hamming(a, b):
    bits = lambda d: np.unpackbits(d, axis=1).astype(np.float32) * 2 - 1
    return bits(a) @ bits(b).T


def cosine(a, b):
    return a.astype(np.float32) @ b.astype(np.float32).T


def lines(xy, F):
    l = np.column_stack([xy, np.ones(len(xy))]) @ F.T
    return l / np.linalg.norm(l[:, :2], axis=1, keepdims=True)


def near_the_line(a, b, F, pixels):
    """(n, m): corners (n, 2) and (m, 2) within so many pixels of each other's epipolar line, b' F a = 0"""
    homogeneous = lambda p: np.column_stack([p, np.ones(len(p))])
    in_b = np.abs(lines(a, F) @ homogeneous(b).T) < pixels
    return in_b & (np.abs(homogeneous(a) @ lines(b, F.T).T) < pixels)


class Validation:
    """Pictures, corners and pairs of the sequences in `folder`; few: a quarter of the pairs

    kept: a file's name to which a sequence's is added: there the pairs are kept for the next time.
    """

    def __init__(self, folder, few=False, kept=None, known=SEQUENCES):
        self.sequences = {}
        for name, s in known.items():
            folders = [os.path.join(folder, f) for f in s.get('folders', [name])]
            if all(map(os.path.isdir, folders)):
                self.sequences[name] = self.prepare(folders, s, 10 if few else MOST, kept and f'{kept}_{name}.npy')
        self.columns = [f'{known[n]["short"]}:{b}' for n in self.sequences for b in BINS[1:]]

    def prepare(self, folders, s, most, kept):
        read = [read_sequence(f) for f in folders]
        paths, T, K = sum((r[0] for r in read), []), np.concatenate([r[1] for r in read]), read[0][2]
        first = len(read[0][0])
        if kept and os.path.exists(kept):
            bins = np.load(kept, allow_pickle=True).tolist()
        else:
            bins = self.find_pairs(range(0, first, s['every']), range(first, len(paths), s['every']), paths, T, K)
            if kept:
                np.save(kept, np.array(bins + [None], object)[:-1])
        rng = np.random.default_rng(1)
        bins = [[p[k] for k in rng.permutation(len(p))[:most]] for p in bins]
        used = sorted({i for p in bins for a, b, _ in p for i in (a, b)})
        images = {i: gray(paths[i]) for i in used}
        both = {i: orb(images[i], corners(images[i])) for i in used}
        return dict(images=images, corners={i: k for i, (k, _) in both.items()}, orb={i: d for i, (_, d) in both.items()}, bins=bins, pixels=s['pixels'])

    @staticmethod
    def find_pairs(ids, others, paths, T, K):
        """-> for each bin of angles [(picture, picture, fundamental matrix (3, 3))]; the second of `others`, where there are any"""
        points = {i: seen_points(i, paths, T, K) for i in (*ids, *others)}
        fx, fy, cx, cy = K
        inverse = np.linalg.inv(np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]]))
        bins = [[] for _ in BINS[1:]]

        def view(X, i, j):      # points of i: share in j's picture, angles
            c = (X - T[j][:3, 3]) @ T[j][:3, :3]
            z = np.maximum(c[:, 2], 1e-3)
            u, v = fx * c[:, 0] / z + cx, fy * c[:, 1] / z + cy
            ok = (c[:, 2] > .1) & (u > 0) & (v > 0) & (u < 639) & (v < 479)
            a, b = X[ok] - T[i][:3, 3], X[ok] - T[j][:3, 3]
            cos = (a * b).sum(1) / np.linalg.norm(a, axis=1) / np.linalg.norm(b, axis=1)
            return ok.mean(), np.degrees(np.arccos(np.clip(cos, -1, 1)))
        for n, i in enumerate(ids):
            for j in others or ids[n + 1:]:
                if len(points[i]) < 30 or len(points[j]) < 30:
                    continue
                (oi, ai), (oj, aj) = view(points[i], i, j), view(points[j], j, i)
                if min(oi, oj) < OVERLAP:
                    continue
                b = np.searchsorted(BINS, np.median(np.r_[ai, aj])) - 1
                if 0 <= b < len(bins):
                    R = T[j][:3, :3].T @ T[i][:3, :3]
                    t = T[j][:3, :3].T @ (T[i][:3, 3] - T[j][:3, 3])
                    if np.linalg.norm(t) < .03:      # no epipolar line to speak of
                        continue
                    x = np.array([[0, -t[2], t[1]], [t[2], 0, -t[0]], [-t[1], t[0], 0]])
                    bins[b].append((i, j, inverse.T @ x @ R @ inverse))
        return bins

    def measure(self, describe, similarity=cosine):
        """describe(image, corners) or 'orb' -> {sequence: (mean true matches of each bin)}"""
        out = {}
        for name, s in self.sequences.items():
            d = s['orb'] if describe == 'orb' else {i: describe(s['images'][i], s['corners'][i]) for i in s['images']}
            xy = {i: np.array([k.pt for k in c]) for i, c in s['corners'].items()}
            means = []
            for pairs in s['bins']:
                true = []
                for i, j, F in pairs:
                    m = similarity(d[i], d[j])
                    best = m.argmax(1)
                    mutual = np.flatnonzero(m.argmax(0)[best] == np.arange(len(best)))
                    near = near_the_line(xy[i], xy[j], F, s['pixels'])
                    p, n = near.mean(), len(mutual)
                    true.append((near[mutual, best[mutual]].sum() - p * n) / (1 - p))
                means.append(float(np.mean(true)) if true else float('nan'))
            out[name] = means
        return out

    def row(self, net):
        """A network's columns of train.py's curve"""
        return dict(zip(self.columns, ['' if np.isnan(v) else round(v, 1) for m in self.measure(learned(net)).values() for v in m]))


def seen_points(i, paths, T, K):
    """World points (n, 3) that picture i and one some frames away see, by SIFT and the true poses"""
    fx, fy, cx, cy = K
    sift = cv2.SIFT_create(700)
    a, da = sift.detectAndCompute(gray(paths[i]), None)
    out = [np.zeros((0, 3))]
    for j in (i - 10, i + 10, i - 25, i + 25):
        if not 0 <= j < len(paths) or np.linalg.norm(T[j][:3, 3] - T[i][:3, 3]) < .04 or sum(map(len, out)) > 250:
            continue
        b, db = sift.detectAndCompute(gray(paths[j]), None)
        if da is None or db is None:
            continue
        good = [m for m, n in cv2.BFMatcher().knnMatch(da, db, k=2) if m.distance < .75 * n.distance]
        if len(good) < 10:
            continue
        ray = lambda kps, idx: np.array([[(kps[k].pt[0] - cx) / fx, (kps[k].pt[1] - cy) / fy] for k in idx]).T
        pa, pb = ray(a, [m.queryIdx for m in good]), ray(b, [m.trainIdx for m in good])
        Pa, Pb = np.linalg.inv(T[i])[:3], np.linalg.inv(T[j])[:3]
        X = cv2.triangulatePoints(Pa, Pb, pa, pb)
        X = (X[:3] / X[3]).T
        ok = np.ones(len(X), bool)
        for P, p in ((Pa, pa), (Pb, pb)):
            c = X @ P[:, :3].T + P[:, 3]
            ok &= (c[:, 2] > .2) & (c[:, 2] < 10) & (np.abs(c[:, :2].T / c[:, 2] - p).max(0) < 4 / fx)
        out.append(X[ok])
    return np.concatenate(out)


def learned(net, count=3, finish=lambda d: d):
    """finish: of the float descriptors, such as net.int8"""
    from net import describe
    return lambda gray, kps: finish(describe(net, gray, np.array([k.pt for k in kps]), np.array([1.2 ** k.octave for k in kps]), count))


def main(arguments=None):
    a = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    a.add_argument('weights', nargs='*', help='files of weights (export.py)')
    a.add_argument('--sequences', required=True)
    a.add_argument('--rendered', action='store_true')
    a.add_argument('--work', help='folder that keeps the pairs for the next time')
    a.add_argument('--octaves', type=int, nargs='+', default=[3])
    a.add_argument('--few', action='store_true', help='a quarter of the pairs, as in training')
    a.add_argument('--sift-sizes', type=float, nargs='+', default=[SIFT_SIZE])
    a = a.parse_args(arguments)
    v = Validation(a.sequences, a.few, a.work and os.path.join(a.work, 'validation'), {**SEQUENCES, **RENDERED} if a.rendered else SEQUENCES)
    print('| mean true matches | ' + ' | '.join(v.sequences) + ' |\n|' + '---|' * (1 + len(v.sequences)))
    print('| pairs | ' + ' | '.join(' / '.join(str(len(b)) for b in s['bins']) for s in v.sequences.values()) + ' |', flush=True)

    def row(name, *how):
        print(f'| {name} | ' + ' | '.join(' / '.join('-' if np.isnan(x) else f'{x:.0f}' if x >= 9.95 else f'{x:.1f}' for x in m) for m in v.measure(*how).values()) + ' |', flush=True)
    row('ORB', 'orb', hamming)
    for size in a.sift_sizes:
        row('upright RootSIFT' + (f', size {size:g}' if len(a.sift_sizes) > 1 else ''), lambda g, k: root_sift(g, k, size))
    if a.weights:
        import export
        from net import bits, int8
        import torch
        torch.set_num_threads(1)
    for w in a.weights:
        net = export.read(w)[0]
        for count in a.octaves:
            name = os.path.basename(w) + (f', {count} octaves' if len(a.octaves) > 1 else '')
            row(name + ', float', learned(net, count))
            row(name + ', int8', learned(net, count, int8))
            row(name + ', 256 bits', learned(net, count, lambda d: np.packbits(bits(d), axis=1)), hamming)


if __name__ == '__main__':
    main()
