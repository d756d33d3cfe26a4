"""Training steps of PyTorch and scikit-learn, one thread, on noise of the same shapes as ours.

Usage: OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 /usr/bin/python3 peer_training.py ROW
Prints the milliseconds of ROW: one update of an LSTM of 250 cells on 64 windows of 200 samples with Adam, clipping and a
burn-in, or one epoch of an MLP 3-50-20-10-1 over 200 000 rows at batch 64.
"""

import sys
import time
import warnings

import numpy as np


def best_seconds(work, runs):
    times = []
    for _ in range(runs):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


def lstm_batch_s():
    import torch

    torch.set_num_threads(1)
    memory, output = torch.nn.LSTM(2, 250), torch.nn.Linear(250, 1)
    parameters = [*memory.parameters(), *output.parameters()]
    optimiser = torch.optim.Adam(parameters, 1e-3)
    x, y = torch.randn(200, 64, 2), torch.randn(200, 64, 1)

    def update():
        optimiser.zero_grad()
        loss = ((output(memory(x)[0]) - y)[20:] ** 2).mean()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(parameters, 1.0)
        optimiser.step()

    return best_seconds(update, 8)


def mlp_epoch_s():
    from sklearn.neural_network import MLPRegressor

    warnings.simplefilter("ignore")  # it has not converged after one epoch
    random = np.random.RandomState(1)
    x, y = random.normal(size=(200_000, 3)).astype(np.float32), random.normal(size=200_000).astype(np.float32)
    network = MLPRegressor((50, 20, 10), batch_size=64, random_state=1, alpha=0.0)
    return best_seconds(lambda: network.partial_fit(x, y), 4)


print(1e3 * {"lstm250_train_batch": lstm_batch_s, "mlp_epoch": mlp_epoch_s}[sys.argv[1]]())
