# Debian userlands in folders, for the scripts beside this one that are run by hand as root.
# Sourced: make_userland and enter are functions.

MIRROR="${MIRROR:-http://deb.debian.org/debian}"

fail() { printf '%s\n' "$@" >&2; exit 2; }

# What this machine lacks to make userlands, and for arm64 ($1) an emulator, registered with the kernel.
need_programs() {
  local packages=() rule=/usr/lib/binfmt.d/qemu-aarch64.conf rules=/proc/sys/fs/binfmt_misc
  [ "$(id -u)" = 0 ] || fail "Only root may make and enter a Debian userland: run this script with sudo."
  command -v debootstrap >/dev/null || packages+=(debootstrap)
  [ "${1:-}" != arm64 ] || [ -e "$rule" ] || packages+=(qemu-user-static)
  if [ "${#packages[@]}" != 0 ]; then
    command -v apt-get >/dev/null || fail "These programs are missing; install them: ${packages[*]}"
    apt-get update -qq
    DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${packages[@]}" >/dev/null
  fi
  [ "${1:-}" = arm64 ] || return 0
  [ -e "$rules/register" ] || mount -t binfmt_misc binfmt_misc "$rules" ||
    fail "This kernel cannot run programs of another processor (binfmt_misc), so that nothing of arm64 runs here."
  [ -e "$rules/qemu-aarch64" ] || grep '^:' "$rule" >"$rules/register"
}

# Makes the userland $1 of Debian's suite $2 and architecture $3 with the packages that follow, unless it is there.
make_userland() {
  local root="$1" suite="$2" architecture="$3"
  [ ! -e "$root/complete" ] || return 0
  [ ! -e "$root" ] || [ -e "$root.log" ] || fail "$root is there and is not of these scripts: name another folder."
  rm -rf "$root"
  mkdir -p "$root"
  local IFS=,
  debootstrap --variant=minbase --arch="$architecture" --include="ca-certificates,${*:4}" "$suite" "$root" "$MIRROR" \
    >"$root.log" 2>&1 || fail "debootstrap failed: $(tail -n 3 "$root.log") (all of it: $root.log)"
  # What this machine trusts beside Debian's authorities, such as a company's proxy.
  if compgen -G '/usr/local/share/ca-certificates/*.crt' >/dev/null; then
    cat /usr/local/share/ca-certificates/*.crt >>"$root/etc/ssl/certs/ca-certificates.crt"
  fi
  touch "$root/complete"
}

# Runs a command in the userland $1, with an environment of its own. What is mounted for it goes with it.
enter() {
  unshare --mount bash -c '
    mount -t proc proc "$0/proc" && mount --rbind /dev "$0/dev" && mount -t sysfs -o ro sysfs "$0/sys" &&
    cp /etc/resolv.conf "$0/etc/resolv.conf" &&
    exec chroot "$0" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LANG=C.UTF-8 "$@"' "$@"
}

# Runs a command and prints how long it took. $1: what it is.
timed() {
  local begun=$SECONDS
  "${@:2}"
  printf '%-60s %5d s\n' "$1" "$((SECONDS - begun))"
}
