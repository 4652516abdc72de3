#!/usr/bin/python3
"""The file of the weights:  export.py FROM TO      state.pt or a file of weights -> a file of weights
                          export.py --reference FILE TEXT     what the network gives for a picture made by a formula
                          export.py --onnx FILE ONNX          the maps, of pictures 640 x 480, for OpenCV's dnn

All numbers are little-endian. The file is
  8 bytes    OASLDESC
  uint32     version, 1
  uint32     number of layers, 14
  float32    natural logarithm of the factor on cosines in training: for training on
  layers     in the order of net.LAYERS; each
    16 bytes   its name, filled with zeros
    4 uint32   outputs, inputs, side of the kernel (3 or 1; layers of the head 1), stride
    halves     weights [output][input][row][column]
    halves     biases [output]
  uint32     CRC-32 (zlib's) of everything before
Batch normalisation is part of the weights. What is computed with them is in `net.Net.maps` and `head`.
"""
import argparse
import struct
import zlib

import numpy as np

MAGIC, VERSION = b'OASLDESC', 1


def write(net, log_temperature, path):
    import os
    from net import LAYERS, fused
    out = MAGIC + struct.pack('<IIf', VERSION, len(LAYERS), log_temperature)
    for name, (weights, biases) in fused(net).items():
        stride = next((m.stride[0] for m in getattr(net, name).modules() if hasattr(m, 'stride')), 1)
        out += name.encode().ljust(16, b'\0') + struct.pack('<4I', *weights.shape[:2], weights.shape[2] if weights.ndim == 4 else 1, stride)
        out += weights.astype('<f2').tobytes() + biases.astype('<f2').tobytes()
    out += struct.pack('<I', zlib.crc32(out))
    with open(path + '.new', 'wb') as f:
        f.write(out)
    os.replace(path + '.new', path)
    return len(out)


def read(path):
    """-> network for describing, log temperature"""
    from net import from_fused
    raw = open(path, 'rb').read()
    if raw[:8] != MAGIC or struct.unpack('<I', raw[-4:])[0] != zlib.crc32(raw[:-4]):
        raise ValueError(f'{path}: not a file of weights, or damaged')
    version, count, log_temperature = struct.unpack_from('<IIf', raw, 8)
    if version != VERSION:
        raise ValueError(f'{path}: version {version}, not {VERSION}')
    layers, p = {}, 20
    for _ in range(count):
        name = raw[p:p + 16].rstrip(b'\0').decode()
        o, i, k, _ = struct.unpack_from('<4I', raw, p + 16)
        p += 32
        weights = np.frombuffer(raw, '<f2', o * i * k * k, p).astype(np.float32)
        p += 2 * weights.size
        biases = np.frombuffer(raw, '<f2', o, p).astype(np.float32)
        p += 2 * o
        layers[name] = weights.reshape((o, i) if name.startswith('head') else (o, i, k, k)), biases
    return from_fused(layers), log_temperature


def formula(w, h):
    """The picture of the reference: uint8 (h, w), integers only"""
    y, x = np.mgrid[0:h, 0:w]
    return ((x * x + 3 * y * y + 5 * x * y) // 32 + 40 * ((x // 9 + y // 7) % 3)).astype(np.uint8)


def reference(net, path, w=120, h=88):
    """Normalised values, values of both maps and descriptors, as lines of text that a test of the C++ reads"""
    import torch
    from net import SIZE, bits, describe, normalise, padded
    image = formula(w, h)
    x = padded(normalise(image))
    with torch.no_grad():
        fine, coarse = net.eval().maps(x)
    lines = [f'# gray of pixel (x, y): the low 8 bits of (x x + 3 y y + 5 x y) / 32 + 40 ((x / 9 + y / 7) mod 3), integer division',
             f'picture {w} {h} input {x.shape[3]} {x.shape[2]} sum {int(image.sum())}', '# normalised x y value']
    lines += [f'normalised {u} {v} {x[0, 0, v, u]:.6f}' for u, v in ((0, 0), (60, 44), (w - 1, h - 1), (17, 70), (w, h))]
    lines.append('# map, cell x y, the first 8 channels')
    for name, m in (('fine', fine), ('coarse', coarse)):
        for u, v in ((0, 0), (5, 4), (m.shape[3] - 1, m.shape[2] - 1)):
            lines.append(f'{name} {u} {v} ' + ' '.join(f'{c:.5f}' for c in m[0, :8, v, u].numpy()))
    xy = np.array([[8, 8], [60, 44], [33.5, 71.25], [111, 5], [90, 80], [64, 20]])
    scale = np.array([1, 1, 1.2, 1.44, 2.48832, 3.58318])
    d = describe(net, image, xy, scale)
    lines.append('# descriptor x y scale, 64 values; bits: the same as 4 numbers of 64 bits')
    for p, s, v, q in zip(xy, scale, d, bits(d).reshape(-1, 4, SIZE)):
        lines.append(f'descriptor {p[0]:g} {p[1]:g} {s:g} ' + ' '.join(f'{c:.5f}' for c in v))
        words = (sum(1 << i for i, b in enumerate(w) if b) for w in q)
        lines.append(f'bits {p[0]:g} {p[1]:g} {s:g} ' + ' '.join(f'{w:016x}' for w in words))
    open(path, 'w').write('\n'.join(lines) + '\n')


def onnx(net, path, w=640, h=480):
    """image (1, 1, h, w), normalised -> fine, coarse; checked with OpenCV"""
    import copy

    import cv2
    import torch
    import torch.nn as nn
    from net import LAYERS, double, fused

    plain = copy.deepcopy(net).eval()
    for name, (weights, biases) in fused(net).items():
        layer = getattr(plain, name)
        if isinstance(layer, nn.Sequential):
            c = layer[0]
            c = nn.Conv2d(c.in_channels, c.out_channels, 3, c.stride, 1)
            c.weight.data, c.bias.data = torch.from_numpy(weights), torch.from_numpy(biases)
            setattr(plain, name, nn.Sequential(c, nn.ReLU()))
    up = nn.ConvTranspose2d(48, 48, 3, 2, 1, 1, groups=48, bias=False)      # `double`, as OpenCV knows it
    up.weight.data[:] = torch.tensor([[.25, .5, .25], [.5, 1, .5], [.25, .5, .25]])
    plain.up = up
    plain.forward = plain.maps
    x = torch.randn(1, 1, h, w)
    torch.onnx.export(plain, x, path, opset_version=11, input_names=['image'], output_names=['fine', 'coarse'])
    dnn = cv2.dnn.readNetFromONNX(path)
    dnn.setInput(x.numpy())
    got = dnn.forward(['fine', 'coarse'])
    with torch.no_grad():
        want = net.eval().maps(x)
    print('largest difference between OpenCV and this:', [float(np.abs(g - t.numpy()).max()) for g, t in zip(got, want)])


def main():
    a = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    a.add_argument('--reference', action='store_true')
    a.add_argument('--onnx', action='store_true')
    a.add_argument('source')
    a.add_argument('target')
    a = a.parse_args()
    if a.source.endswith('.pt'):
        import torch
        from net import Net
        state = torch.load(a.source)
        net, log_temperature = Net(), float(state['temperature'])
        net.load_state_dict(state['mean'])
    else:
        net, log_temperature = read(a.source)
    if a.reference:
        reference(net, a.target)
    elif a.onnx:
        onnx(net, a.target)
    else:
        print(write(net, log_temperature, a.target), 'bytes')


if __name__ == '__main__':
    main()
