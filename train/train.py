#!/usr/bin/python3
"""Trains the descriptor:  train/train.py --work FOLDER [--steps N] [--minutes M] [--seed S] [--from FILE] [--run NAME]

Reads the scenes' caches in FOLDER/cache (render.sh) and writes FOLDER/NAME/: state.pt, from which it
goes on when started again; weights.bin, the network so far (export.py); curve.csv and curve.png.
The learning rate falls to 0 over the steps; a step is about .4 s of one core, and as much of another
for its pairs. When the minutes are over this call ends, and the next goes on.
"""
import argparse
import csv
import multiprocessing
import os
import time
from queue import Full

import numpy as np

PAIRS, NEW = 12, 6     # pairs of a step, and how many of them were not used before: making one costs as much as learning from it
KEPT = 600             # pairs kept for using again
PEAK, WARM = 2e-3, 100      # learning rate, and in how many steps it is reached
NEAR = 6.0             # pixels about the true place within which another corner is neither right nor wrong
MEAN = .999            # the weights that count are a running mean over about 1000 steps


def make_pairs(queue, work, seed, mild):
    import data
    rng, parent = np.random.default_rng(seed), os.getppid()
    scenes, weights, made, tried, looked = {}, None, 0, 0, 0
    while os.getppid() == parent:      # ends with the training, however that ended
        if time.time() - looked > 60:      # scenes may come while training runs
            looked = time.time()
            for f in sorted(os.listdir(os.path.join(work, 'cache'))):
                name = f[:-4]
                if f.endswith('.npz') and not f.endswith('_new.npz') and name not in scenes:
                    scenes[name] = data.Scene(work, name)
                    print('scene', name, len(scenes[name].images), 'frames', flush=True)
            if not scenes:
                time.sleep(10)
                continue
            weights = np.array([2. if n.startswith('flat') else 1. for n in scenes])      # a flat has more to see
            weights /= weights.sum()
        pair = data.random_pair(rng, list(scenes.values()), weights, mild=mild)
        tried += 1
        if pair is None:
            continue
        packed = data.pack(pair)
        while os.getppid() == parent:
            try:
                queue.put(packed, timeout=10)
                break
            except Full:
                pass
        made += 1
        if made % 5000 == 0:
            print(f'{made} pairs made of {tried} tried', flush=True)


def loss_of(net, log_temperature, batch):
    """Each corner's partner among all of the other picture, both ways -> loss, share found by mutual nearest neighbours"""
    import torch
    import torch.nn.functional as F
    a, b, pa, pb, ta, tb, counts = batch
    n = len(a)
    d = net(torch.cat([a, b]).contiguous(memory_format=torch.channels_last), torch.cat([pa, pb]))
    s = torch.bmm(d[:n], d[n:].transpose(1, 2)) * log_temperature.exp().clamp(max=80)
    k = torch.arange(s.shape[1])
    m, na, nb = (counts[:, c, None, None] for c in range(3))
    same = (k[:, None] == k) & (k[:, None] < m)
    ignored = ((torch.cdist(tb, pb) < NEAR) | (torch.cdist(ta, pa).transpose(1, 2) < NEAR)) & ~same
    s = s.masked_fill(ignored | (k[:, None] >= na) | (k >= nb), -1e4)
    target = k.expand(n, -1)
    weight = (target < m[:, 0]).float()
    weight = weight / weight.sum()
    loss = ((F.cross_entropy(s.transpose(1, 2), target, reduction='none') + F.cross_entropy(s, target, reduction='none')) * weight).sum()
    with torch.no_grad():
        found = (((s.argmax(2) == target) & (s.argmax(1) == target)).float() * weight).sum().item()
    return loss, found


def draw(curve):
    """curve.csv -> curve.png: loss and share found; true matches of the validation"""
    import cv2
    rows = [{k: float(v) for k, v in r.items() if v} for r in csv.DictReader(open(curve))]
    picture = np.full((720, 1000, 3), 255, np.uint8)
    last = max(r['step'] for r in rows) + 1
    keys = [['loss', 'found'], sorted({k for r in rows for k in r if ':' in k})]
    for part, names in enumerate(keys):
        y0 = 40 + 350 * part
        for c, name in enumerate(names):
            xy = [(r['step'], r[name]) for r in rows if name in r]
            if not xy:
                continue
            top = max(v for _, v in xy) * 1.05 + 1e-9
            colour = [(180, 60, 0), (0, 90, 200), (60, 140, 0), (120, 0, 150), (200, 130, 0), (0, 0, 0), (90, 90, 90), (0, 160, 160)][c % 8]
            p = np.array([(60 + 700 * x / last, y0 + 290 * (1 - v / top)) for x, v in xy], np.int32)
            cv2.polylines(picture, [p], False, colour, 1, cv2.LINE_AA)
            cv2.putText(picture, f'{name}: {xy[-1][1]:.3g} (top {top:.3g})', (775, y0 + 20 + 24 * c), 0, .42, colour, 1, cv2.LINE_AA)
        cv2.rectangle(picture, (60, y0), (760, y0 + 290), (160, 160, 160), 1)
        cv2.putText(picture, f'step {int(last - 1)}', (690, y0 + 308), 0, .42, (0, 0, 0), 1, cv2.LINE_AA)
    cv2.imwrite(curve[:-4] + '.png', picture)


def main():
    a = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    a.add_argument('--work', required=True, help='folder of the caches and the runs')
    a.add_argument('--steps', type=int, default=8000)
    a.add_argument('--minutes', type=float, default=1e9, help='of this call at most')
    a.add_argument('--seed', type=int, default=0)
    a.add_argument('--run', default='run')
    a.add_argument('--from', dest='start', help='weights (export.py) to begin with')
    a.add_argument('--peak', type=float, default=PEAK, help='learning rate')
    a.add_argument('--mild', type=float, default=0., help='share of the pairs to which light and camera do little')
    a.add_argument('--threads', type=int, default=1)
    a.add_argument('--sequences', help='folder of fr3_office_200 and redkitchen: adds their true matches to the curve')
    a = a.parse_args()
    import torch
    import evaluate
    import export
    from net import Net, learnable
    torch.set_num_threads(a.threads)
    torch.manual_seed(a.seed)
    out = os.path.join(a.work, a.run)
    os.makedirs(out, exist_ok=True)
    state_file, curve = os.path.join(out, 'state.pt'), os.path.join(out, 'curve.csv')

    net = Net()
    log_temperature = torch.nn.Parameter(torch.tensor(float(np.log(1 / .07))))
    state = torch.load(state_file) if os.path.exists(state_file) else None
    step, trained = (state['step'], state['seconds']) if state else (0, 0.)
    queue = multiprocessing.Queue(30)
    worker = multiprocessing.Process(target=make_pairs, args=(queue, a.work, [a.seed, step], a.mild), daemon=True)
    worker.start()
    if not state and a.start:
        net, value = export.read(a.start)
        log_temperature.data.fill_(value)
        learnable(net, torch.cat([torch.from_numpy(np.stack(queue.get()[:2])) for _ in range(48)]))
    par = [{'params': [p for p in net.parameters() if p.ndim > 1], 'weight_decay': 1e-3},
           {'params': [p for p in net.parameters() if p.ndim <= 1] + [log_temperature], 'weight_decay': 0}]
    optimiser = torch.optim.AdamW(par, lr=a.peak, betas=(.9, .98))
    if state:
        net.load_state_dict(state['net'])
        log_temperature.data.copy_(state['temperature'])
        optimiser.load_state_dict(state['optimiser'])
    mean = {k: v.clone() for k, v in (state['mean'] if state else net.state_dict()).items()}
    net.train()
    validation = evaluate.Validation(a.sequences, few=True, kept=os.path.join(a.work, 'validation')) if a.sequences else None

    def save():
        torch.save({'net': net.state_dict(), 'mean': mean, 'temperature': log_temperature.data, 'optimiser': optimiser.state_dict(),
                    'step': step, 'seconds': trained}, state_file + '.new')
        os.replace(state_file + '.new', state_file)
        averaged = Net()
        averaged.load_state_dict(mean)
        export.write(averaged, log_temperature.item(), os.path.join(out, 'weights.bin'))
        return averaged.eval()

    def log(loss, found, **more):
        known = ['step', 'minutes', 'loss', 'found', 'temperature', 'rate'] + (validation.columns if validation else [])
        row = {'step': step, 'minutes': round(trained / 60, 2), 'loss': round(loss, 4), 'found': round(found, 4),
               'temperature': round(log_temperature.exp().item(), 2), 'rate': f'{rate:.2e}', **more}
        rows = list(csv.DictReader(open(curve))) if os.path.exists(curve) else []
        rows = [r for r in rows if int(r['step']) < step] + [row]      # what was lost with the last state is made again
        with open(curve + '.new', 'w', newline='') as f:
            w = csv.DictWriter(f, list(dict.fromkeys(list(rows[0]) + known)), restval='')
            w.writeheader()
            w.writerows(rows)
        os.replace(curve + '.new', curve)
        draw(curve)
        print(' '.join(f'{k} {v}' for k, v in row.items()), f's/step {(time.time() - began) / max(1, step - first):.2f} waited {waited / (time.time() - began):.2f}', flush=True)

    rng, kept, losses, founds = np.random.default_rng([a.seed, step, 1]), [], [], []
    began, saved, waited, first = time.time(), time.time(), 0., step
    while step < a.steps and time.time() - began < 60 * a.minutes:
        t = time.time()
        left = 1 - step / a.steps
        rate = a.peak * min(1, (step - first + 1) / WARM) * (.5 - .5 * np.cos(np.pi * min(1, left / .95))) + 1e-6
        for g in optimiser.param_groups:
            g['lr'] = rate
        new = [queue.get() for _ in range(NEW if len(kept) >= 4 * PAIRS else PAIRS)]
        waited += time.time() - t
        old = [kept[i] for i in rng.permutation(len(kept))[:PAIRS - len(new)]]
        kept = (kept + new)[-KEPT:]
        loss, found = loss_of(net, log_temperature, [torch.from_numpy(np.stack(x)) for x in zip(*new, *old)])
        optimiser.zero_grad(set_to_none=True)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(net.parameters(), 5.)
        optimiser.step()
        step += 1
        keep = min(MEAN, step / (step + 20))
        for k, v in net.state_dict().items():
            if v.is_floating_point():
                mean[k].mul_(keep).add_(v, alpha=1 - keep)
        losses.append(loss.item())
        founds.append(found)
        trained += time.time() - t
        if step % 100 == 0:
            due = validation and (step % 1000 == 0 or step in (200, 500))
            more = validation.row(save()) if due else {}
            log(np.mean(losses), np.mean(founds), **more)
            losses, founds = [], []
        if time.time() - saved > 120:
            saved = time.time()
            save()
    save()
    worker.terminate()
    print('done', flush=True)


if __name__ == '__main__':
    main()
