# Run the tests of each package under src/, then those across packages under test/.
# `make test` calls this in a shell that has sourced env.bash.

export PYTHONDONTWRITEBYTECODE=1  # no caches among the sources
export ROS_DOMAIN_ID=$((RANDOM % 100 + 1))  # apart from other nodes on this machine
colcon test-result --delete-yes > /dev/null
colcon test --base-paths src --executor sequential \
  --event-handlers console_direct+ --return-code-on-test-failure
packages=$?
python -m pytest test
across=$?
fastdds shm clean &> /dev/null  # a node that a test kills leaves its 64 MiB in /dev/shm
if [ $packages != 0 ]; then
  echo 'Tests of packages have failed:' >&2
  colcon test-result >&2
fi
[ $packages = 0 ] && [ $across = 0 ]
