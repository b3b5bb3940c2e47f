# Source this file in bash: it gives a shell in which the built nodes run.

_fisheye_env() {
  local root nounset
  root=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
  if [ ! -e "$root/install/.built" ]; then
    echo "Nothing is built here yet: run 'make build' in $root first." >&2
    return 1
  fi
  [[ $- == *u* ]] && nounset=-u || nounset=+u
  set +u  # the scripts of colcon and ament read variables that may be unset
  source "$root/.venv/local_setup.bash"
  source "$root/install/setup.bash"
  set $nounset
  export RMW_IMPLEMENTATION=${RMW_IMPLEMENTATION:-rmw_fastrtps_cpp}
  export ROS_AUTOMATIC_DISCOVERY_RANGE=${ROS_AUTOMATIC_DISCOVERY_RANGE:-LOCALHOST}
  export ROS_LOG_DIR=${ROS_LOG_DIR:-$root/log/ros}
}
_fisheye_env
