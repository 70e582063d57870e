#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "common/geo/datum.hpp"

// Mistakes on the command line, in words for people.
namespace seastitch {

// The subcommand of that name; null if there is none.
const CLI::App* FindCommand(const CLI::App& app, const std::string& name);

// "there is no command 'WORD'; did you mean ...?"
std::string UnknownCommand(const CLI::App& app, const std::string& word);

// Checks of a number.
CLI::Validator AboveZero();
CLI::Validator AtLeastZero();

// Latitude and longitude in degrees: "43.07,-70.71", "43.07 -70.71", or in two words. Throws
// CLI::ValidationError that names what was expected.
Datum ParseDatum(const std::vector<std::string>& words);

// One line for what CLI11 found wrong with the arguments of a command, with the nearest option in
// place of an unknown one.
std::string Explain(const CLI::App& app, const std::string& command, const CLI::ParseError& error);

}  // namespace seastitch
