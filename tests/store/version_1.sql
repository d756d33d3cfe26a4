BEGIN TRANSACTION;
CREATE TABLE results(
  trial BIGINT PRIMARY KEY REFERENCES trials(id),
  study BIGINT NOT NULL REFERENCES studies(id),
  attempt BIGINT NOT NULL,
  value DOUBLE PRECISION,
  result TEXT NOT NULL,
  seconds DOUBLE PRECISION NOT NULL,
  finished_at DOUBLE PRECISION NOT NULL);
INSERT INTO "results" VALUES(1,1,1,0.8571,'{"rmse":0.8571}',0.05,1.79598471074801087376e+09);
INSERT INTO "results" VALUES(2,1,1,NULL,'',0.0,1.79598471074901676171e+09);
CREATE TABLE samples(
  trial BIGINT PRIMARY KEY REFERENCES trials(id),
  bytes BLOB NOT NULL);
INSERT INTO "samples" VALUES(1,X'0102');
CREATE TABLE schema_version(
  version BIGINT PRIMARY KEY,
  applied_at DOUBLE PRECISION NOT NULL,
  torsio_version TEXT NOT NULL);
INSERT INTO "schema_version" VALUES(1,1.79598471074599933625e+09,'0.2.0');
CREATE TABLE steps(
  study BIGINT NOT NULL REFERENCES studies(id),
  family TEXT NOT NULL,
  step BIGINT NOT NULL,
  is_decided BIGINT NOT NULL DEFAULT 0,
  PRIMARY KEY(study, family, step));
INSERT INTO "steps" VALUES(1,'linear',0,0);
CREATE TABLE studies(
  id INTEGER PRIMARY KEY AUTOINCREMENT,
  name TEXT NOT NULL UNIQUE,
  kind TEXT NOT NULL,
  spec TEXT NOT NULL,
  torsio_version TEXT NOT NULL,
  trials BIGINT NOT NULL DEFAULT 0,
  total_priority DOUBLE PRECISION NOT NULL DEFAULT 0,
  created_at DOUBLE PRECISION NOT NULL);
INSERT INTO "studies" VALUES(1,'line','specimens','{"seed":1}','0.2.0',3,6.0,1.79598471074700498581e+09);
CREATE TABLE trials(
  id INTEGER PRIMARY KEY AUTOINCREMENT,
  study BIGINT NOT NULL REFERENCES studies(id),
  key TEXT NOT NULL,
  spec TEXT NOT NULL,
  family TEXT NOT NULL,
  device TEXT NOT NULL,
  step BIGINT NOT NULL,
  priority DOUBLE PRECISION NOT NULL,
  state BIGINT NOT NULL DEFAULT 0,
  attempt BIGINT NOT NULL DEFAULT 0,
  lost BIGINT NOT NULL DEFAULT 0,
  worker TEXT NOT NULL DEFAULT '',
  lease_until DOUBLE PRECISION NOT NULL DEFAULT 0,
  reason TEXT NOT NULL DEFAULT '',
  UNIQUE(study, key, step));
INSERT INTO "trials" VALUES(1,1,'specimen dfki-50#0001','{"specimen":"dfki-50#0001"}','linear','dfki-50#0001',0,3.0,2,1,0,'bench:1',1.79598477074801087384e+09,'');
INSERT INTO "trials" VALUES(2,1,'specimen dfki-50#0002','{"specimen":"dfki-50#0002"}','linear','dfki-50#0002',0,2.0,3,1,0,'bench:1',1.79598477074801087384e+09,'it diverged');
INSERT INTO "trials" VALUES(3,1,'specimen dfki-50#0003','{"specimen":"dfki-50#0003"}','linear','dfki-50#0003',0,1.0,0,0,0,'',0.0,'');
CREATE INDEX trials_waiting ON trials(study, priority DESC, id) WHERE state = 0;
CREATE INDEX trials_running ON trials(study, lease_until) WHERE state = 1;
CREATE INDEX trials_unfinished ON trials(study, family, step) WHERE state < 2;
CREATE INDEX trials_of_device ON trials(device, id) WHERE device <> '';
CREATE INDEX results_by_value ON results(study, value, trial);
DELETE FROM "sqlite_sequence";
INSERT INTO "sqlite_sequence" VALUES('studies',1);
INSERT INTO "sqlite_sequence" VALUES('trials',3);
COMMIT;
