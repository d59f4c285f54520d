# shellcheck shell=sh
# ./upswing demo: builds the page and serves it with the program. Read by ./upswing, whose functions
# it uses, after tools/web.sh.
: "${root:?}" "${setup:?}" "${program:?}" "${python:?}"

page=$root/build/web
program=${UPSWING:-$program} # tests set another one

# Runs the program with the page of this copy, or with the one that UPSWING_PAGE names.
demo() {
  help=no
  for word; do
    case $word in -h | --help) help=yes ;; esac
  done
  # shellcheck disable=SC2046  # a list of words
  set_up release upswing $(extra_programs demo)
  [ -x "$program" ] || fail "the program is not built: run ./upswing demo once without --no-setup"
  if [ -z "${UPSWING_PAGE:-}" ]; then
    [ "$setup" = no ] || [ "$help" = yes ] || build_demo
    export UPSWING_PAGE="$page"
  fi
  exec "$program" demo "$@"
}

# A checksum of all sources of the page and of its core.
page_hash() {
  (cd "$root/web" && find . \( -name node_modules -o -name tests \) -prune -o -type f -print0 |
    LC_ALL=C sort -z | xargs -0 sha256sum | sha256sum)
  "$python" -B "$root/web/wasm/build.py" --key
}

# Builds the page, with Node and the core, if it is missing or made from other sources.
build_demo() {
  set_up_node
  (
    lock
    stamp=$page.stamp
    hash=$(page_hash)
    [ ! -f "$page/index.html" ] || [ "$(cat "$stamp" 2>/dev/null)" != "$hash" ] || exit 0
    set_up_core
    say "building the page"
    rm -f "$stamp"
    cd web
    npm run --silent build -- --logLevel error >&2 || fail "the page could not be built (see above)"
    echo "$hash" >"$stamp"
  ) </dev/null || exit 1
}
