# Sourced by tools/farm-test and tools/farm-costs: starts Slurm with two virtual nodes on this machine, and ends it. Needs
# the folder $work, and the function `fail`.
# shellcheck shell=bash disable=SC2034,SC2154
daemons=()   # process ids of what start_slurm started
slurmd=(0 0) # those of the two nodes

# stop_slurm: ends what start_slurm started: jobs and their steps first, then the daemons.
stop_slurm() {
  [[ -n ${SLURM_CONF:-} ]] || return 0
  scancel --user "$(id -un)" 2>/dev/null
  for _ in {1..100}; do
    [[ -z $(squeue --noheader 2>/dev/null) ]] && break
    sleep 0.2
  done
  for process in "${daemons[@]}"; do kill "$process" 2>/dev/null; done
  for process in "${daemons[@]}"; do wait "$process" 2>/dev/null; done
  for process in $(steps); do kill -9 "$process" 2>/dev/null; done # steps of a node that was killed
}

# steps: prints the processes of Slurm's jobs that belong to this script, by its folder in their environment.
steps() {
  local folder
  for folder in /proc/[0-9]*; do
    if [[ ${folder#/proc/} != "$$" ]] && grep -qzF "SLURM_CONF=$work/" "$folder/environ" 2>/dev/null &&
      [[ $(cat "$folder/comm" 2>/dev/null) =~ ^(slurmstepd|slurm_script|bash|duet.*)$ ]] &&
      grep -qz "^SLURM_JOB_ID=" "$folder/environ" 2>/dev/null; then
      echo "${folder#/proc/}"
    fi
  done
}

start_slurm() {
  local host user port
  host=$(hostname -s) user=$(id -un) port=$((20000 + $$ % 20000))
  mkdir -p "$work/slurm/state" "$work/munge"
  dd if=/dev/urandom of="$work/munge/key" bs=1024 count=1 status=none
  chmod 0400 "$work/munge/key"
  chmod 0755 "$work" "$work/munge" "$work/slurm"
  local munged=(munged --foreground --force --key-file="$work/munge/key" --socket="$work/munge/socket"
    --pid-file="$work/munge/pid" --log-file="$work/munge/log" --seed-file="$work/munge/seed")
  if ((EUID == 0)); then
    chown -R munge: "$work/munge"
    setpriv --reuid munge --regid munge --clear-groups "${munged[@]}" >"$work/munge/output" 2>&1 &
  else
    "${munged[@]}" >"$work/munge/output" 2>&1 &
  fi
  daemons+=($!)
  cat >"$work/slurm/slurm.conf" <<CONF
ClusterName=farmtest
SlurmctldHost=$host(127.0.0.1)
SlurmUser=$user
SlurmdUser=$user
AuthType=auth/munge
AuthInfo=socket=$work/munge/socket
CredType=cred/munge
SlurmctldPort=$port
SlurmctldPidFile=$work/slurm/slurmctld.pid
SlurmdPidFile=$work/slurm/%n.pid
SlurmdSpoolDir=$work/slurm/%n
StateSaveLocation=$work/slurm/state
SlurmctldLogFile=$work/slurm/slurmctld.log
SlurmdLogFile=$work/slurm/%n.log
ProctrackType=proctrack/pgid
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
MpiDefault=none
ReturnToService=2
SlurmdTimeout=10
SlurmctldTimeout=10
SchedulerParameters=bf_interval=1,sched_interval=1,sched_min_interval=1
SlurmdParameters=config_overrides
NodeName=n[1-2] NodeHostname=$host NodeAddr=127.0.0.1 Port=[$((port + 1))-$((port + 2))] CPUs=2
PartitionName=all Nodes=n[1-2] Default=YES State=UP
CONF
  export SLURM_CONF=$work/slurm/slurm.conf
  mkdir -p "$work/slurm/n1" "$work/slurm/n2"
  for _ in {1..100}; do
    [[ -S $work/munge/socket ]] && break
    sleep 0.1
  done
  slurmctld -D -f "$SLURM_CONF" >"$work/slurm/output" 2>&1 &
  daemons+=($!)
  for node in 1 2; do
    slurmd -D -f "$SLURM_CONF" -N "n$node" >"$work/slurm/n$node.output" 2>&1 &
    slurmd[node - 1]=$!
    daemons+=($!)
  done
  for _ in {1..300}; do
    [[ $(sinfo --noheader --format=%T 2>/dev/null) == idle ]] && return
    sleep 0.2
  done
  cat "$work/slurm/output" >&2
  sinfo >&2 || true
  fail "Slurm does not start"
}

# wait_for_queue: waits until no job is left.
wait_for_queue() {
  for ((i = 0; i < 3000; ++i)); do
    [[ -z $(squeue --noheader) ]] && return
    sleep 0.3
  done
  squeue >&2
  fail "jobs do not end"
}
