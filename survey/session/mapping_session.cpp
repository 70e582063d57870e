#include "survey/session/mapping_session.hpp"

#include <memory>
#include <utility>

#include "common/core/checked.hpp"

namespace seastitch {

MappingSession::MappingSession(const MapperConfig& mapper,
                               const OptimizerParams& optimizer,
                               SurveyCollector* collector,
                               std::function<bool()> stopped,
                               std::function<void(const MapperEvent&)> on_event)
    : collector_(collector),
      stopped_(std::move(stopped)),
      on_event_(std::move(on_event)),
      mapper_(mapper, [this](const MapperEvent& event) { On(event); }),
      optimizer_(optimizer) {}

void MappingSession::Add(const Received& received) {
  mapper_.Add(received);
  Exchange();
}

void MappingSession::AddSubmap(Submap submap, std::optional<Mapper::OfDive> of_dive) {
  mapper_.AddSubmap(std::move(submap), std::move(of_dive));
  Settle();
}

void MappingSession::Finish() {
  mapper_.Finish();
  Settle();
}

void MappingSession::On(const MapperEvent& event) {
  on_event_(event);
  const auto collect = [this](const auto& result) {
    if (const auto checked = Checked(Quantised(result))) collector_->Add(*checked);
  };
  const auto send = [this](auto&& letter) {
    if (auto checked = Checked(letter)) letters_.emplace_back(*std::move(checked));
  };
  std::visit(Overloaded{[&](const NavState& nav) { collect(nav); },
                        [&](const CorrectedNavState& corrected) { collect(corrected); },
                        [&](const std::shared_ptr<const Submap>& submap) { collect(*submap); },
                        [&](const GraphStep& step) { send(step.update); },
                        [&](const CovarianceQuestion& question) { send(question.request); },
                        [](const JournalEntry&) {}},
             event);
}

void MappingSession::Exchange() {
  while (!letters_.empty()) {
    const Letter letter = std::move(letters_.front());
    letters_.pop_front();
    std::visit([this](const auto& what) { Deliver(what); }, letter);
  }
}

void MappingSession::Settle() {
  Exchange();
  while (!stopped_() && mapper_.LookAgain()) Exchange();
}

void MappingSession::Deliver(const GraphUpdate& update) {
  collector_->Add(update);
  if (!optimizer_.Add(update)) return;
  std::optional<PoseGraph> solution = optimizer_.Solve(
      update.final || update.resumed ? SolveStart::kFromDeadReckoning : SolveStart::kWarm);
  if (!solution) return;  // the last one stays in use
  solution_ = *std::move(solution);
  solution_.graph_id = update.graph_id;
  if (auto checked = Checked(solution_)) letters_.emplace_back(*std::move(checked));
}

void MappingSession::Deliver(const PoseGraph& solution) {
  mapper_.mapper().Take(solution);
  collector_->Add(solution);
}

// A graph that has grown since the request gives no answer: it would be out of date.
void MappingSession::Deliver(const CovarianceRequest& request) {
  if (request.graph_version != solution_.graph_version || request.graph_id != solution_.graph_id)
    return;
  PairCovariances answer{request.sender,
                         request.seq,
                         request.graph_version,
                         optimizer_.RelativeCovariances(request.pairs),
                         request.graph_id};
  if (auto checked = Checked(std::move(answer))) letters_.emplace_back(*std::move(checked));
}

void MappingSession::Deliver(const PairCovariances& answer) { mapper_.mapper().Take(answer); }

}  // namespace seastitch
