"""The network: a small encoder and decoder of depthwise separable convolutions, and its export.

Input 1 x 3 x H x W with H and W multiples of 16, output logits 1 x classes x H/4 x W/4. Only
convolutions, rectifiers, sums and bilinear enlargement by two, so that small runtimes can run it.
"""
import numpy as np
import torch
from torch import nn
from torch.nn import functional as F

STEM, QUARTER, EIGHTH, SIXTEENTH = 16, 32, 48, 104


class Conv(nn.Module):
    """Convolution, batch normalization and (mostly) a rectifier."""

    def __init__(self, inputs, outputs, size=1, stride=1, groups=1, relu=True):
        super().__init__()
        self.conv = nn.Conv2d(inputs, outputs, size, stride, size // 2, groups=groups, bias=False)
        self.norm = nn.BatchNorm2d(outputs)
        self.relu = relu

    def forward(self, x):
        x = self.norm(self.conv(x))
        return F.relu(x) if self.relu else x

    def folded(self):
        """Returns weights and bias with the normalization multiplied in."""
        n = self.norm
        scale = n.weight / torch.sqrt(n.running_var + n.eps)
        return self.conv.weight * scale[:, None, None, None], n.bias - n.running_mean * scale


class Separable(nn.Module):
    """A convolution per channel and one across channels; adds its input where shapes agree."""

    def __init__(self, inputs, outputs, size=3, stride=1):
        super().__init__()
        self.spatial = Conv(inputs, inputs, size, stride, groups=inputs)
        self.residual = stride == 1 and inputs == outputs
        self.across = Conv(inputs, outputs, relu=not self.residual)

    def forward(self, x):
        y = self.across(self.spatial(x))
        return F.relu(x + y) if self.residual else y


class Merge(nn.Module):
    """Enlarges the coarse features by two and adds the fine ones."""

    def __init__(self, coarse, fine):
        super().__init__()
        self.coarse = Conv(coarse, fine, relu=False)
        self.fine = Conv(fine, fine, relu=False)

    def forward(self, coarse, fine):
        up = F.interpolate(self.coarse(coarse), scale_factor=2, mode="bilinear", align_corners=False)
        return F.relu(up + self.fine(fine))


class Network(nn.Module):
    """Returns logits at a quarter of the input's size."""

    def __init__(self, classes):
        super().__init__()
        self.stem = Conv(3, STEM, 3, 2)
        self.quarter = nn.Sequential(Conv(STEM, QUARTER, 3, 2), Separable(QUARTER, QUARTER))
        self.eighth = nn.Sequential(
            Separable(QUARTER, EIGHTH, 3, 2), Separable(EIGHTH, EIGHTH), Separable(EIGHTH, EIGHTH)
        )
        # Wide kernels: what a surface is shows in what lies around it.
        self.sixteenth = nn.Sequential(
            Separable(EIGHTH, SIXTEENTH, 3, 2),
            Separable(SIXTEENTH, SIXTEENTH, 5),
            Separable(SIXTEENTH, SIXTEENTH, 7),
            Separable(SIXTEENTH, SIXTEENTH, 7),
        )
        self.up8 = Merge(SIXTEENTH, EIGHTH)
        self.mix8 = Separable(EIGHTH, EIGHTH, 5)
        self.up4 = Merge(EIGHTH, QUARTER)
        self.mix4 = nn.Sequential(Separable(QUARTER, QUARTER), Separable(QUARTER, QUARTER))
        self.head = nn.Conv2d(QUARTER, classes, 1)

    def forward(self, x):
        a = self.quarter(self.stem(x))
        b = self.eighth(a)
        c = self.sixteenth(b)
        d = self.mix8(self.up8(c, b))
        return self.head(self.mix4(self.up4(d, a)))


class Writer:
    """Writes the network as an ONNX graph, normalizations folded into the convolutions."""

    def __init__(self):
        self.nodes, self.weights, self.count = [], [], 0

    def add(self, kind, inputs, output=None, **attributes):
        import onnx

        self.count += 1
        output = output or f"t{self.count}"
        self.nodes.append(onnx.helper.make_node(kind, inputs, [output], **attributes))
        return output

    def weight(self, name, values):
        import onnx

        values = np.ascontiguousarray(values, dtype=np.float32)
        self.weights.append(onnx.numpy_helper.from_array(values, name))
        return name

    def convolve(self, x, conv, weight, bias, output=None):
        n = len(self.weights)
        names = [self.weight(f"w{n}", weight.detach()), self.weight(f"b{n}", bias.detach())]
        pad = list(conv.padding) * 2
        return self.add(
            "Conv", [x, *names], output, group=conv.groups, pads=pad,
            kernel_shape=list(conv.kernel_size), strides=list(conv.stride),
        )

    def conv(self, x, m):
        y = self.convolve(x, m.conv, *m.folded())
        return self.add("Relu", [y]) if m.relu else y

    def module(self, x, m):
        if isinstance(m, nn.Sequential):
            for part in m:
                x = self.module(x, part)
            return x
        if isinstance(m, Separable):
            y = self.conv(self.conv(x, m.spatial), m.across)
            return self.add("Relu", [self.add("Add", [x, y])]) if m.residual else y
        return self.conv(x, m)

    def merge(self, coarse, fine, m):
        x = self.conv(coarse, m.coarse)
        up = self.add(
            "Resize", [x, "", "double"], mode="linear", coordinate_transformation_mode="half_pixel"
        )
        return self.add("Relu", [self.add("Add", [up, self.conv(fine, m.fine)])])


def export(network, classes, path):
    """Writes an ONNX file: `pixel_values` 1 x 3 x height x width to `logits`."""
    import onnx
    from onnx import TensorProto, helper

    network.eval()
    w = Writer()
    w.weight("double", [1, 1, 2, 2])
    a = w.module(w.conv("pixel_values", network.stem), network.quarter)
    b = w.module(a, network.eighth)
    c = w.module(b, network.sixteenth)
    d = w.module(w.merge(c, b, network.up8), network.mix8)
    e = w.module(w.merge(d, a, network.up4), network.mix4)
    w.convolve(e, network.head, network.head.weight, network.head.bias, "logits")
    graph = helper.make_graph(
        w.nodes,
        "segmenter",
        [helper.make_tensor_value_info("pixel_values", TensorProto.FLOAT, [1, 3, "height", "width"])],
        [helper.make_tensor_value_info(
            "logits", TensorProto.FLOAT, [1, classes, "height_4", "width_4"])],
        w.weights,
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 13)])
    model.ir_version = 8
    onnx.checker.check_model(model)
    onnx.save(model, path)
