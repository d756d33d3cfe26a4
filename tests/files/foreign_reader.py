"""Reads a safetensors file by the format's description alone: no code of torsio, standard library only.

usage: foreign_reader.py FILE TENSOR    prints the tensor's shape and values, then the card's family
"""
import json
import math
import struct
import sys

with open(sys.argv[1], "rb") as file:
    content = file.read()
(header_length,) = struct.unpack("<Q", content[:8])
header = json.loads(content[8 : 8 + header_length])
data = content[8 + header_length :]
card = json.loads(header.pop("__metadata__")["torsio"])
types = {"F64": ("d", 8), "I64": ("q", 8), "F32": ("f", 4), "U8": ("B", 1)}

end = 0
for name, tensor in sorted(header.items(), key=lambda item: item[1]["data_offsets"]):
    assert tensor["data_offsets"][0] == end, f"{name} does not begin where the one before it ends"
    size = types[tensor["dtype"]][1]
    assert tensor["data_offsets"][0] % size == 0, f"{name} is not aligned"
    end = tensor["data_offsets"][1]
    assert tensor["data_offsets"][1] - tensor["data_offsets"][0] == math.prod(tensor["shape"]) * size, name
assert end == len(data), "bytes after the last tensor"

wanted = header[sys.argv[2]]
values = struct.iter_unpack("<" + types[wanted["dtype"]][0], data[slice(*wanted["data_offsets"])])
print(wanted["shape"], [value for (value,) in values], card["family"])
