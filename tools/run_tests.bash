# Run the tests of each package under src/, then those across packages under test/.
# `make test` calls this in a shell that has sourced env.bash.

export PYTHONDONTWRITEBYTECODE=1  # no caches among the sources
colcon test-result --delete-yes > /dev/null
colcon test --base-paths src --parallel-workers 2 \
  --event-handlers console_cohesion+ --return-code-on-test-failure \
  --pytest-args --numprocesses 2
packages=$?
python -m pytest --numprocesses 2 --dist loadfile --durations 10 test
across=$?
fastdds shm clean &> /dev/null  # a node that a test kills leaves its 64 MiB in /dev/shm
if [ $packages != 0 ]; then
  echo 'Tests of packages have failed:' >&2
  colcon test-result >&2
fi
{ command -v chromium && { command -v chromedriver || command -v chromium.chromedriver; }; } > /dev/null ||
  echo 'Not tested: what needs a browser. On Debian sudo apt install chromium chromium-driver,' \
    'on Ubuntu sudo snap install chromium'
command -v ip > /dev/null ||
  echo 'Not tested: what needs a network of its own. sudo apt install iproute2'
[ $packages = 0 ] && [ $across = 0 ]
