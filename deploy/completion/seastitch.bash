# Completion for seastitch and its processes. It asks the program itself: options, then subcommands or files.
_seastitch() {
  local program=$1 current=$2 subcommand=() help words
  if [[ ${program##*/} == seastitch && $COMP_CWORD -gt 1 ]]; then
    subcommand=("${COMP_WORDS[1]}")
  fi
  help=$("$program" "${subcommand[@]}" --help 2>/dev/null) || return 0
  if [[ $current == -* ]]; then
    words=$(sed -n 's/^  \(-[a-z],\)\{0,1\}\(--[a-z0-9-]*\).*/\2/p' <<<"$help")
  else
    words=$(sed -n '/^Subcommands:/,/^$/s/^  \([a-z-]*\) .*/\1/p' <<<"$help")
  fi
  mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current")
}
complete -o default -F _seastitch seastitch seastitch-imu-driver seastitch-dvl-driver seastitch-mbes-driver \
  seastitch-nav-driver seastitch-nav-output seastitch-mapper seastitch-optimizer seastitch-logger seastitch-page
