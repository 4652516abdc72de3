"""The descriptor's network, and how an image's corners are described with it.

An image (gray, uint8, h x w) is made to one, a half and a quarter of its size (`octaves`). Each is
normalised by its local contrast and filled with zeros at the right and at the bottom to multiples of
32. Convolutions give a fine map (24 channels, a cell every 4 pixels) and a coarse one (64 channels,
a cell every 8 pixels); cell (0, 0) lies on pixel (0, 0) in both. At a corner both maps are sampled
bilinearly, and two small layers make 64 numbers of length 1.
"""
import copy

import cv2
import numpy as np
import torch
import torch.nn as nn
import torch.nn.functional as F

SIZE = 64          # values of a descriptor
STEP = 32          # sides of the network's input are multiples of it
WINDOW = 41        # pixels; side of the square in which contrast is measured
FLOOR = 5.0        # gray values; a contrast below it is noise
INT8_SCALE = 256   # a value is .125 in the root mean square; above .496 it is cut off


def normalise(gray):
    """uint8 (h, w) -> float32 (h, w): less the mean of the window, over its deviation plus FLOOR.

    Beyond the border the image is mirrored about its outermost pixel (OpenCV's BORDER_REFLECT_101).
    """
    g = gray.astype(np.float32)
    mean = cv2.blur(g, (WINDOW, WINDOW))
    variance = cv2.blur(g * g, (WINDOW, WINDOW)) - mean * mean
    return (g - mean) / (np.sqrt(np.maximum(variance, 0)) + FLOOR)


def conv(inputs, outputs, stride=1):
    """3 x 3, batch normalisation (part of the convolution in the file), ReLU."""
    return nn.Sequential(nn.Conv2d(inputs, outputs, 3, stride, 1, bias=False),
                         nn.BatchNorm2d(outputs), nn.ReLU(inplace=True))


def double(x):
    """(n, c, h, w) -> (n, c, 2 h, 2 w): even cells are copies, odd ones means; zero beyond the end."""
    h, w = x.shape[2:]
    x = F.interpolate(F.pad(x, (0, 1, 0, 1)), size=(2 * h + 1, 2 * w + 1), mode='bilinear', align_corners=True)
    return x[:, :, :2 * h, :2 * w]


class Net(nn.Module):
    def __init__(self):
        super().__init__()
        self.first = conv(1, 8, 2)
        self.quarter_a, self.quarter_b = conv(8, 16, 2), conv(16, 24)
        self.eighth_a, self.eighth_b = conv(24, 48, 2), conv(48, 48)
        self.sixteenth_a, self.sixteenth_b, self.sixteenth_c = conv(48, 48, 2), conv(48, 48), conv(48, 48)
        self.thirtysecond = conv(48, 48, 2)
        self.mix_32, self.mix_16 = nn.Conv2d(48, 48, 1), nn.Conv2d(48, 48, 1)
        self.coarse = conv(48, 64)
        self.head_a, self.head_b = nn.Linear(24 + 64, 160), nn.Linear(160, SIZE)
        self.up = double

    def maps(self, x):
        """(n, 1, h, w), h and w multiples of 32 -> fine (n, 24, h/4, w/4), coarse (n, 64, h/8, w/8)"""
        fine = self.quarter_b(self.quarter_a(self.first(x)))
        e = self.eighth_a(fine)
        e = e + self.eighth_b(e)
        s = self.sixteenth_a(e)
        s = s + self.sixteenth_b(s)
        s = s + self.sixteenth_c(s)
        s = self.mix_16(s) + self.up(self.mix_32(self.thirtysecond(s)))
        return fine, self.coarse(e + self.up(s))

    def head(self, maps, xy):
        """maps; xy (n, k, 2), pixels of the input, integers at the centres -> (n, k, 64), length 1"""
        at = []
        for m, cell in zip(maps, (4, 8)):
            last = torch.tensor([m.shape[3] - 1, m.shape[2] - 1], dtype=xy.dtype)
            grid = (xy / cell * 2 / last - 1)[:, None]
            at.append(F.grid_sample(m, grid, mode='bilinear', padding_mode='border', align_corners=True)[:, :, 0])
        v = torch.cat(at, 1).transpose(1, 2)
        return F.normalize(self.head_b(F.relu(self.head_a(v))), dim=-1)

    def forward(self, x, xy):
        return self.head(self.maps(x), xy)


def octaves(gray, count=3):
    """[the image, half of it, a quarter of it...]: means of 2 x 2 pixels.

    Pixel x of one is pixel (x - .5) / 2 of the next.
    """
    out = [gray]
    while len(out) < count:
        h, w = out[-1].shape
        out.append(cv2.resize(out[-1][:h // 2 * 2, :w // 2 * 2], (w // 2, h // 2), interpolation=cv2.INTER_AREA))
    return out


def octave_of(scale, count=3):
    """scale (n,) of corners (1.2 ** level of ORB's pyramid) -> the nearest octave (n,)"""
    return np.clip(np.round(np.log2(scale)).astype(int), 0, count - 1)


def padded(x):
    """float32 (h, w) -> tensor (1, 1, H, W), multiples of 32, zeros at the right and at the bottom"""
    h, w = x.shape
    return torch.from_numpy(np.pad(x, ((0, -h % STEP), (0, -w % STEP))))[None, None]


@torch.no_grad()
def describe(net, gray, xy, scale, count=3):
    """uint8 (h, w), corners (n, 2) in pixels, their scales (n,) -> float32 (n, 64)

    count: 3 octaves; with 1 every corner is described in the image itself.
    """
    net.eval()
    out = np.zeros((len(xy), SIZE), np.float32)
    octave = octave_of(scale, count)
    xy = np.asarray(xy, np.float32)
    for o, image in enumerate(octaves(gray, count)):
        mine = octave == o
        if mine.any():
            out[mine] = net(padded(normalise(image)), torch.from_numpy(xy[mine])[None])[0].numpy()
        xy = (xy - .5) / 2
    return out


def int8(descriptors):
    """float (n, 64) -> int8 (n, 64)"""
    return np.clip(np.round(descriptors * INT8_SCALE), -127, 127).astype(np.int8)


def hadamard(n):
    h = np.array([[1.]])
    while len(h) < n:
        h = np.block([[h, h], [h, -h]])
    return h


def bits(descriptors):
    """float (n, 64) -> bool (n, 256): the signs of the values, and of three turned copies of them

    A turn is H S H T, with a Hadamard matrix H and signs S and T that are bits of pi, the lowest first.
    """
    words = 0x243F6A8885A308D3, 0x13198A2E03707344, 0xA4093822299F31D0, 0x082EFA98EC4E6C89
    signs = [np.array([1 - 2 * (w >> i & 1) for i in range(SIZE)]) for w in words]
    h = hadamard(SIZE)
    turns = [descriptors] + [descriptors * t @ h * signs[0] @ h for t in signs[1:]]
    return np.concatenate(turns, 1) > 0


LAYERS = ['first', 'quarter_a', 'quarter_b', 'eighth_a', 'eighth_b', 'sixteenth_a', 'sixteenth_b', 'sixteenth_c',
          'thirtysecond', 'mix_32', 'mix_16', 'coarse', 'head_a', 'head_b']


def fused(net):
    """The network without batch normalisation: {layer: (weights (o, i, k, k) or (o, i), biases (o,))}"""
    out = {}
    for name in LAYERS:
        layer = copy.deepcopy(getattr(net, name)).eval()
        if isinstance(layer, nn.Sequential):
            layer = torch.nn.utils.fusion.fuse_conv_bn_eval(layer[0], layer[1])
        out[name] = layer.weight.detach().numpy(), layer.bias.detach().numpy()
    return out


def from_fused(layers):
    """The reverse. Batch normalisation is the identity: for describing; `learnable` before training."""
    net = Net()
    for name, (weights, biases) in layers.items():
        layer = getattr(net, name)
        weights, biases = torch.from_numpy(weights.astype(np.float32)), torch.from_numpy(biases.astype(np.float32))
        with torch.no_grad():
            if isinstance(layer, nn.Sequential):
                layer[0].weight.copy_(weights)
                layer[1].weight.fill_(float(np.sqrt(1 + layer[1].eps)))
                layer[1].bias.copy_(biases)
            else:
                layer.weight.copy_(weights)
                layer.bias.copy_(biases)
    return net.eval()


@torch.no_grad()
def learnable(net, x):
    """Gives a network of `from_fused` batch statistics, those of x (n, 1, h, w), and leaves what it computes."""
    def measure(layer, inputs):
        v = inputs[0].transpose(0, 1).flatten(1)
        mean, variance = v.mean(1), v.var(1)
        layer.running_mean.copy_(mean)
        layer.running_var.copy_(variance)
        layer.bias.add_(mean)
        layer.weight.copy_((variance + layer.eps).sqrt())

    norms = [m for m in net.modules() if isinstance(m, nn.BatchNorm2d)]
    hooks = [m.register_forward_pre_hook(measure) for m in norms]
    net.eval()
    net.maps(x)
    for h in hooks:
        h.remove()
    return net
