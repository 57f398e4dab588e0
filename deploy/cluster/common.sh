# What up.sh and down.sh share: where the cluster is, and how to run PostgreSQL's programs.

cluster=${1:-/tmp/polyest-cluster}
postgresql=$(find /usr/lib/postgresql -maxdepth 2 -name bin | sort -V | tail -1)

# Runs a program of PostgreSQL's, which does not run as root.
as_postgres() {
  local program=$postgresql/$1
  shift
  if [ "$(id -u)" = 0 ]; then
    (cd / && runuser -u postgres -- "$program" "$@")
  else
    "$program" "$@"
  fi
}
