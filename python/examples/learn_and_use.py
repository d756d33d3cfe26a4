"""From recordings in DataFrames to an estimator in a loop:  python learn_and_use.py"""

import numpy as np

import torsio

# Any table with units in its column names; here those of a simulated bench.
train = [torsio.simulate("dfki-50", "sweep", seed=seed, duration_s=30.0) for seed in (1, 2)]
frame = train[0].to_pandas()  # what a reader of .mat, HDF5 or Parquet gives
train[0] = torsio.Recording.from_pandas(frame, name="bench")
test = torsio.simulate("dfki-50", "sweep", seed=3, duration_s=30.0, lever_m=0.2)

report = torsio.check(train)
print(f"check: {report.verdict}")

data = torsio.Dataset(train=train, test=test)
model = torsio.fit(data, "maxwell_slip", seed=1)
print(torsio.evaluate(model, data).to_pandas()[["split", "rmse", "fit_percent"]])

estimator = model.estimator(rate_Hz=1000.0)
names = estimator.raw_inputs
rows = np.column_stack([test[name] for name in names])
for row in rows[:2000]:  # a control loop: one row per tick, SI units
    torque = estimator.step(*row)
    if torque.fault:
        continue  # the value is finite, but not to be used
print(f"{torque.value:.2f} +- {torque.std_dev:.2f} Nm")

state = estimator.save()  # branch: what would the next second be?
future = estimator.run(rows[2000:3000])
estimator.load(state)
print(future.to_pandas()["value"].describe()[["min", "max"]])

joints = model.batch(64)  # many joints of one model, one per row
print(joints.step(np.tile(rows[0], (64, 1))))
