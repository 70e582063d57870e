#!/usr/bin/env bash
# clean_root.sh ROOT PACKAGE.deb [NAME...]: makes ROOT a Debian in which nothing is installed but the essential packages,
# what PACKAGE.deb depends on, and packages of those names. Taken from this machine's own installed packages: nothing is
# fetched.
set -euo pipefail
root=$1
depends="$(dpkg-deb -f "$2" Depends | sed 's/([^)]*)//g; s/|[^,]*//g; s/,/ /g') ${*:3}"
# Whoever provides one of those names.
providers=$(dpkg-query -W -f '${Package} ${Provides}\n' | awk -v names="$depends" '
  BEGIN {n = split(names, list, " "); for (i = 1; i <= n; ++i) wanted[list[i]]}
  {gsub(/\([^)]*\)|,/, ""); for (i = 2; i <= NF; ++i) if ($i in wanted) {print $1; next}}')
essential=$(dpkg-query -W -f '${Package} ${Essential}\n' | awk '$2 == "yes" {print $1}')

mkdir -p "$root"/{dev,proc,run,tmp,usr/{bin,sbin,lib,lib64},var/lib/dpkg/{info,updates,triggers}}
chmod 1777 "$root/tmp"
for directory in bin sbin lib lib64; do
  ln -s "usr/$directory" "$root/$directory"
done

# What these need in turn.
# shellcheck disable=SC2086
apt-cache depends --recurse --installed --no-recommends --no-suggests --no-conflicts --no-breaks --no-replaces \
  --no-enhances $depends $providers $essential | grep -o '^[a-z0-9][^ :]*' | sort -u >"$root/tmp/reached"
dpkg-query -W -f '${db:Status-Status} ${Package} ${binary:Package}\n' |
  awk 'NR == FNR {reached[$1]; next} $1 == "installed" && $2 in reached {print $3}' "$root/tmp/reached" - \
    >"$root/tmp/packages"

# Their files.
xargs dpkg-query -L <"$root/tmp/packages" | grep '^/' | sort -u >"$root/tmp/files"
tar -C / --no-recursion --ignore-failed-read -cf - -T <(sed 's,^/,,' "$root/tmp/files") 2>/dev/null |
  tar -C "$root" --keep-directory-symlink -xf -

# What dpkg knows.
awk -v RS= -v ORS='\n\n' 'NR == FNR {n = split($0, list, "\n"); for (i = 1; i <= n; ++i) {sub(":.*", "", list[i]);
  wanted[list[i]]}; next} {split($2, name, "\n"); if (name[1] in wanted) print}' \
  "$root/tmp/packages" /var/lib/dpkg/status >"$root/var/lib/dpkg/status"
while read -r package; do
  cp -a /var/lib/dpkg/info/"$package".* "$root/var/lib/dpkg/info/"
done <"$root/tmp/packages"
cp -a /var/lib/dpkg/info/format "$root/var/lib/dpkg/info/"
cp "$root"/usr/share/base-passwd/passwd.master "$root/etc/passwd"
cp "$root"/usr/share/base-passwd/group.master "$root/etc/group"
rm "$root"/tmp/*
# The names that a package goes by without owning them, such as libblas.so.3: of those here, the best.
cp -a /var/lib/dpkg/alternatives "$root/var/lib/dpkg/"
mkdir -p "$root/etc/alternatives"
for name in "$root"/var/lib/dpkg/alternatives/*; do
  chroot "$root" update-alternatives --auto "$(basename "$name")" >/dev/null 2>&1 || true
done
chroot "$root" ldconfig
