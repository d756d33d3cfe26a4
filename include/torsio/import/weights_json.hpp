#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string_view>

#include "torsio/import/foreign_network.hpp"

namespace torsio {

/// Reads the weights of a PyTorch network by tensor name, from untrusted JSON:
///
///     {"tensors": {"lstm.weight_ih_l0": {"shape": [32, 2], "data": [...]}, ...}}
///
/// `<p>weight_ih_l<k>`, `weight_hh_l<k>`, `bias_ih_l<k>`, `bias_hh_l<k>` are the recurrent layers
/// (4 H rows: LSTM, 3 H: GRU), `<p>weight` and `<p>bias` the dense ones after them, in the order of
/// their names ("2." before "10."); `in_scale` multiplies the inputs, `out_scale` the output. Data
/// are row by row.
/// @param activation activation of all dense layers but the last, which the names do not contain.
/// @throws Error naming the tensor: not this format, an unknown name, a shape that does not
/// fit, a number that is not finite; also if there are hidden dense layers and no `activation`.
[[nodiscard]] ForeignNetwork parse_weights_json(std::span<const std::byte> bytes,
                                                std::string_view place,
                                                std::optional<Activation> activation = {});

}  // namespace torsio
