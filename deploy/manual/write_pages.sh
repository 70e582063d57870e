#!/bin/sh
# write_pages.sh BIN_DIR OUT_DIR COMMANDS.md: the manual page of every program and of every subcommand of `seastitch`,
# from what each says to --help, and its exit statuses from the table of docs/commands.md.
set -eu
bin_dir=$1
out_dir=$2
commands_page=$3
export PATH="$bin_dir:$PATH" LC_ALL=C
version=$(seastitch-mapper --version)

sections=$(mktemp)
trap 'rm -f "$sections"' EXIT
{
  echo '[EXIT STATUS]'
  sed -n '/^## Exit status/,/^# /s/^| \([0-9][0-9]*\) | \(.*\) |$/.TP\n\1\n\2/p' "$commands_page" | tr -d '`'
  cat <<'END'

[FILES]
.TP
/etc/seastitch
configuration of the processes, and seastitch's own where none is named
.TP
/var/lib/seastitch/dives
logs and maps of the dives

[SEE ALSO]
.BR seastitch (1),
.BR seastitch-mapper (8),
.BR seastitch-logger (8)
END
} >"$sections"
grep -q '^130$' "$sections"  # the table is where it was

# page SECTION PROGRAM [SUBCOMMAND]
page() {
  section=$1
  shift
  name=$(echo "$*" | tr ' ' '-')
  file=$out_dir/man$section/$name.$section
  mkdir -p "$out_dir/man$section"
  help2man --no-info --include="$sections" --section="$section" --version-string="$version" --source="Seastitch $version" \
    --name="$("$@" --help | sed -n '1{s/\.$//;p}')" --output="$file" "$*"
  sed -i "s/^$* \\\\- /$name \\\\- /" "$file"
  gzip -9n "$file"
}

rm -rf "$out_dir"
page 1 seastitch
for subcommand in $(seastitch --help | sed -n '/^Subcommands:/,$s/^  \([a-z-]*\) .*/\1/p'); do
  page 1 seastitch "$subcommand"
done
for program in "$bin_dir"/seastitch-*-driver "$bin_dir"/seastitch-nav-output "$bin_dir"/seastitch-mapper \
  "$bin_dir"/seastitch-optimizer "$bin_dir"/seastitch-logger "$bin_dir"/seastitch-page; do
  page 8 "$(basename "$program")"
done
