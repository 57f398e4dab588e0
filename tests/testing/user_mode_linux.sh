# Boots this machine's own files in user-mode Linux, an ordinary process with a kernel of its own.
# Sourced by scripts that put into the folder $scratch the first process as `init`, and see there
# what it wrote into `output`. Needs the package user-mode-linux.

# boot_uml SECONDS ARGUMENT...
#
# Boots with further arguments for the kernel, and shows `output` as it grows. Returns when the
# machine is off, or after so many seconds. What the kernel says is in `console`.
boot_uml() {
  local timeout_s="$1"
  shift
  : >"$scratch/output"
  echo "==> booting user-mode Linux" >&2
  # Consoles of their own would need a terminal.
  timeout --kill-after=10 "$timeout_s" linux.uml rootfstype=hostfs rootflags=/ "$@" \
    init="$scratch/init" uml_dir="$scratch/uml" \
    con=null con0=null,fd:1 </dev/null >"$scratch/console" 2>&1 &
  uml_pid=$!
  tail --pid="$uml_pid" --lines=+1 --follow "$scratch/output"
  wait "$uml_pid" || true
  uml_pid=""
}

# Ends the machine, if it runs, and removes the folder.
clean_uml() {
  # timeout passes the signal on to the kernel, which has a session of its own and ends its processes.
  [[ -z "${uml_pid-}" ]] || { kill "$uml_pid" && wait "$uml_pid"; } 2>/dev/null || true
  rm -rf "$scratch"
}
