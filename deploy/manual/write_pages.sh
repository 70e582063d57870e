#!/bin/sh
# write_pages.sh BIN_DIR OUT_DIR: the manual page of every program and of every subcommand of `seastitch`,
# from what each says to --help.
set -eu
bin_dir=$1
out_dir=$2
export PATH="$bin_dir:$PATH" LC_ALL=C
version=$(seastitch-mapper --version)

# page SECTION PROGRAM [SUBCOMMAND]
page() {
  section=$1
  shift
  name=$(echo "$*" | tr ' ' '-')
  file=$out_dir/man$section/$name.$section
  mkdir -p "$out_dir/man$section"
  help2man --no-info --section="$section" --version-string="$version" --source="Seastitch $version" \
    --name="$("$@" --help | sed -n '1{s/\.$//;p}')" --output="$file" "$*"
  sed -i "s/^$* \\\\- /$name \\\\- /" "$file"
  gzip -9n "$file"
}

rm -rf "$out_dir"
page 1 seastitch
for subcommand in $(seastitch --help | sed -n '/^Subcommands:/,$s/^  \([a-z-]*\) .*/\1/p'); do
  page 1 seastitch "$subcommand"
done
for program in "$bin_dir"/seastitch-*-driver "$bin_dir"/seastitch-mapper "$bin_dir"/seastitch-optimizer \
  "$bin_dir"/seastitch-logger; do
  page 8 "$(basename "$program")"
done
