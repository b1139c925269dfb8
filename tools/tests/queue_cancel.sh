#!/bin/sh
# In the place of scancel and qdel: the end of a job is asked for, then made, as queues do: a worker
# of dask told twice to end may wait for ever.
here=$(dirname "$0")
kill -- -"$1"
(sleep 3; kill -s KILL -- -"$1") > "$here/said.$$" 2>&1 &
