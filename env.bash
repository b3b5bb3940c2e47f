# Source this file in bash: it gives a shell in which the built nodes run.

_fisheye=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
if [ ! -e "$_fisheye/install/.built" ]; then
  echo "Nothing is built here yet: run 'make build' in $_fisheye first." >&2
  unset _fisheye
  return 1
fi
export RMW_IMPLEMENTATION="${RMW_IMPLEMENTATION:-rmw_fastrtps_cpp}"
export ROS_LOG_DIR="${ROS_LOG_DIR:-$_fisheye/log/ros}"
export FISHEYE_DATA="${FISHEYE_DATA:-$_fisheye/../shared/data}"  # real pictures, for tests and benchmarks
export MPLCONFIGDIR="${MPLCONFIGDIR:-$_fisheye/.venv/matplotlib}"  # its caches, else in your home

# colcon's and ament's scripts read variables that may be unset.
case $- in *u*) _fisheye_unset=-u ;; *) _fisheye_unset=+u ;; esac
set +u
source "$_fisheye/.venv/local_setup.bash" &&
  source "$_fisheye/install/setup.bash"  # also names config/fastdds.xml and keeps discovery on this machine
set $_fisheye_unset
unset _fisheye _fisheye_unset
