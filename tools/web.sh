# shellcheck shell=sh
# What the page needs besides the C++ program: Node, its packages, a Chromium for the tests.
# Read by ./upswing and tools/web_test, which set $root.

node_version=24.19.0 # fetched where there is none that will do
# shellcheck disable=SC2034  # read by the scripts that read this one
own_node=$root/build/deps/node-$node_version

# Whether Vite runs on this version of Node: 20.19, 22.12 or later ones.
node_will_do() {
  minor=${1#*.}
  minor=${minor%%.*}
  case $1 in
    v20.*) [ "$minor" -ge 19 ] ;;
    v22.*) [ "$minor" -ge 12 ] ;;
    v2[3-9].* | v[3-9][0-9].*) ;;
    *) false ;;
  esac
}

# Puts Node and npm on the PATH if they are not there yet; fails if there are none that will do.
find_node() {
  ! { node_will_do "$(node --version 2>/dev/null)" && command -v npm >/dev/null; } || return 0
  [ -x "$own_node/bin/npm" ] || return 1
  PATH=$own_node/bin:$PATH
}

lock_hash() { sha256sum <"$root/web/package-lock.json"; }

# Whether web/node_modules is what the lock file says.
modules_are_current() {
  stamp=$root/web/node_modules/.upswing-lock
  [ -f "$stamp" ] && [ "$(cat "$stamp")" = "$(lock_hash)" ]
}

# Prints the Chromium that tests run: UPSWING_CHROMIUM or one on the PATH. It has to start, since
# Ubuntu's chromium-browser may be no more than a hint at a snap.
find_chromium() {
  for chromium in ${UPSWING_CHROMIUM:+"$UPSWING_CHROMIUM"} chromium chromium-browser google-chrome; do
    "$chromium" --version >/dev/null 2>&1 </dev/null || continue
    command -v "$chromium"
    return
  done
  return 1
}

# Where Playwright puts its own Chromium, on systems that have no package of one.
export PLAYWRIGHT_BROWSERS_PATH="$root/build/deps/playwright"
has_own_chromium() { [ -n "$(find "$PLAYWRIGHT_BROWSERS_PATH" -name INSTALLATION_COMPLETE 2>/dev/null)" ]; }
