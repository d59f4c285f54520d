# shellcheck shell=sh
# ./upswing view: its own packages. Read by ./upswing, whose functions it uses.
: "${packages:?}" "${picture_packages:?}" "${window_packages:?}"

# view_needs ARGUMENTS: adds to `packages` what these need; sets `viewer` if they open a window.
view_needs() {
  pictures=yes window=yes film=no recorded=no
  for word; do
    case $word in
      -h | --help) pictures=no window=no ;;
      --headless | --record | --record=*) window=no ;;
    esac
    [ "$recorded" = no ] || is_film "$word"
    recorded=no
    case $word in
      --record) recorded=yes ;;
      --record=*) is_film "$word" ;;
    esac
  done
  [ "$pictures" = no ] || packages="$packages $picture_packages"
  [ "$film" = no ] || packages="$packages ffmpeg"
  if [ "$window" = yes ]; then
    packages="$packages $window_packages"
    viewer=yes
  fi
}

# Whether ffmpeg writes a file of this name.
is_film() {
  case $1 in *.[mM][pP]4 | *.[gG][iI][fF]) film=yes ;; esac
}
